//! The parameters of a clutch as a user writes them.

use super::{Clutch, Stage};
use crate::element::{InvalidParameter, finite, not_negative};
use serde::{Deserialize, Serialize};

/// Stages of both sides at once, or side by side.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ClutchKeys {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stages: Option<Vec<Stage>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    drive: Option<Vec<Stage>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    coast: Option<Vec<Stage>>,
    #[serde(default)]
    everywhere: bool,
}

impl TryFrom<ClutchKeys> for Clutch {
    type Error = String;

    fn try_from(written: ClutchKeys) -> Result<Self, String> {
        let everywhere = written.everywhere;
        match (written.stages, written.drive, written.coast) {
            (Some(stages), None, None) => Ok(Clutch {
                drive: stages.clone(),
                coast: stages,
                everywhere,
            }),
            (None, Some(drive), Some(coast)) => Ok(Clutch {
                drive,
                coast,
                everywhere,
            }),
            (Some(_), ..) => Err("stages (both sides) excludes drive and coast".into()),
            _ => Err("stages (both sides), or drive and coast together, are required".into()),
        }
    }
}

impl From<Clutch> for ClutchKeys {
    fn from(law: Clutch) -> ClutchKeys {
        let is_one = law.drive == law.coast;
        ClutchKeys {
            stages: is_one.then(|| law.drive.clone()),
            drive: (!is_one).then_some(law.drive),
            coast: (!is_one).then_some(law.coast),
            everywhere: law.everywhere,
        }
    }
}

/// What is wrong with the stages of a side.
pub(super) fn check(key: &str, stages: &[Stage]) -> Result<(), InvalidParameter> {
    if stages.is_empty() {
        return Err(InvalidParameter::about(
            key,
            "empty: wanted at least one stage",
        ));
    }
    let mut end = 0.0;
    for (k, stage) in stages.iter().enumerate() {
        let name = |field: &str| format!("{key}[{k}].{field}");
        not_negative(&name("stiffness"), stage.stiffness)?;
        not_negative(&name("hysteresis"), stage.hysteresis)?;
        if let Some(stiffness) = stage.hysteresis_stiffness {
            finite(&name("hysteresis_stiffness"), stiffness)?;
            if stiffness <= 0.0 {
                let name = name("hysteresis_stiffness");
                return Err(InvalidParameter::new(name, stiffness, "> 0"));
            }
        }
        match stage.to {
            Some(to) => {
                finite(&name("to"), to)?;
                if to <= end {
                    let wanted = match k {
                        0 => "> 0".to_string(),
                        _ => format!(
                            "greater than {end}, where the stage before ends: stages ascend"
                        ),
                    };
                    return Err(InvalidParameter::new(name("to"), to, wanted));
                }
                end = to;
            }
            None if k + 1 < stages.len() => {
                let message = "missing: every stage except the last one needs an end";
                return Err(InvalidParameter::about(name("to"), message));
            }
            None => {}
        }
    }
    Ok(())
}
