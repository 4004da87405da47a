//! The named numbers of a model, for `gearlash check --numbers`.

use crate::element::ParameterRange;
use crate::model::{Model, NamedNumber};
use comfy_table::{Table, presets};

/// A row per number.
pub(super) fn text(model: &Model) -> String {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.set_header(["number", "value", "unit", "range", ""]);
    for number in model.numbers() {
        table.add_row(row(number));
    }
    format!("{table}\n")
}

fn row(number: NamedNumber) -> [String; 5] {
    let range = match number.range {
        ParameterRange::Any => "",
        ParameterRange::NotNegative => ">= 0",
        ParameterRange::Positive => "> 0",
    };
    let origin = if number.is_written { "" } else { "default" };
    // All digits: the value may be copied into --set.
    let value = format!("{:?}", number.value);
    [number.name, value, number.unit, range.into(), origin.into()]
}
