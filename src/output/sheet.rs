//! Sizes of a static figure: the widths and the type of a journal.

use crate::report::FigureSize;

/// Distance of lines over the size of their type.
pub(super) const LINE_HEIGHT: f64 = 1.3;
/// Between the panels of a row, and above a panel without heading.
pub(super) const GAP: f64 = 8.0;
/// Pixels per millimetre: 96 per inch.
const MILLIMETRE: f64 = 96.0 / 25.4;

/// Sizes of a figure in pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sheet {
    pub width: f64,
    pub tick: u32,
    pub label: u32,
    pub title: u32,
    /// Panels side by side.
    pub columns: usize,
    /// Height of a frame.
    pub height: f64,
}

impl Sheet {
    /// Height of ticks and label of an abscissa.
    pub fn texts(&self) -> f64 {
        f64::from(self.tick) * 1.6 + f64::from(self.label) * 1.9
    }

    /// The sheet of a figure with a given number of panels.
    pub fn new(size: FigureSize, panels: usize) -> Sheet {
        let width = |millimetres: f64| (millimetres * MILLIMETRE).round();
        match size {
            // 7, 7.5 and 8 points.
            FigureSize::OneColumn => {
                let width = width(85.0);
                let height = width * if panels <= 1 { 0.62 } else { 0.42 };
                Sheet {
                    width,
                    tick: 9,
                    label: 10,
                    title: 11,
                    columns: 1,
                    height,
                }
            }
            // 8, 8.5 and 10 points.
            FigureSize::TwoColumns => {
                let width = width(178.0);
                let (columns, share) = match panels {
                    0 | 1 => (1, 0.46),
                    2 => (1, 0.30),
                    3 => (1, 0.24),
                    4..=8 => (2, 0.22),
                    _ => (3, 0.16),
                };
                Sheet {
                    width,
                    tick: 11,
                    label: 12,
                    title: 14,
                    columns,
                    height: width * share,
                }
            }
        }
    }
}
