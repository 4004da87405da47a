//! Where legend and list of events of a figure go.

use super::panel::Frame;
use super::sheet::{GAP, Sheet};

/// Where legend and list of events go: `top` moves down with each.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    pub left: f64,
    pub top: f64,
    pub width: f64,
}

impl Room {
    /// Below all panels.
    pub fn below(sheet: &Sheet, frames: &[Frame], bottom: f64) -> Room {
        let left = frames.first().map_or(GAP, |f| f.left);
        let width = sheet.width - left - GAP;
        Room {
            left,
            top: bottom,
            width,
        }
    }

    /// What a last row that is not full leaves free.
    pub fn free(sheet: &Sheet, frames: &[Frame]) -> Option<Room> {
        let columns = sheet.columns.min(frames.len()).max(1);
        // The panel above the first free place has its ticks below it.
        let above = match frames.len() % columns {
            0 => return None,
            _ => frames.get(frames.len() - columns)?,
        };
        let texts = if above.has_x_texts {
            sheet.texts()
        } else {
            0.0
        };
        Some(Room {
            left: above.left,
            top: frames.last()?.top + texts,
            width: sheet.width - above.left - GAP,
        })
    }
}
