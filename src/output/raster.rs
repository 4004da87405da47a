//! A table over two columns as coloured cells.

use std::collections::{HashMap, VecDeque};

use crate::report::Values;

/// Colours of kinds of cells: light, so that curves and dots stay visible on them, and apart for colour-blind readers (Tol).
const KINDS: [&str; 8] = [
    "#77AADD", "#EE8866", "#EEDD88", "#99DDFF", "#FFAABB", "#44BB99", "#BBCC33", "#AAAA00",
];
/// Colours of numbers, from the least to the largest (viridis).
const RAMP: [(u8, u8, u8); 9] = [
    (68, 1, 84),
    (72, 40, 120),
    (62, 74, 137),
    (49, 104, 142),
    (38, 130, 142),
    (31, 158, 137),
    (53, 183, 121),
    (109, 205, 89),
    (253, 231, 37),
];
/// Steps of colour between the least and the largest number.
const STEPS: usize = 48;
/// Steps that a legend names.
const NAMED: usize = 5;
/// Kinds that a legend explains.
const MOST_KINDS: usize = 12;
/// Colour of all the others.
const OTHERS: &str = "#9A8FA0";
/// Colour of what nothing is known of.
const UNKNOWN: &str = "#DDDDDD";

/// A colour with what it says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Level {
    /// Word, or number.
    pub text: String,
    /// `#rrggbb`.
    pub color: String,
}

/// Cells of a rectangular grid.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Raster {
    /// Centres of the columns and of the rows, ascending.
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    /// Level of every cell, row by row; `None` where there is no value.
    pub cells: Vec<Option<usize>>,
    pub levels: Vec<Level>,
    /// Whether levels are steps of a number.
    pub is_continuous: bool,
}

impl Raster {
    /// The cells of a table. Places of the grid without a row take the level of the nearest ones, as a grid refined in parts has it.
    pub fn new(x: &[f64], y: &[f64], values: &Values, names: &[(String, String)]) -> Raster {
        let (columns, rows) = (distinct(x), distinct(y));
        let (levels, of_row, is_continuous) = match values {
            Values::Float(numbers) => {
                let (levels, list) = steps(numbers);
                (levels, list, true)
            }
            values => {
                let (levels, list) = kinds(values, names);
                (levels, list, false)
            }
        };
        let mut raster = Raster {
            cells: vec![None; columns.len() * rows.len()],
            x: columns,
            y: rows,
            levels,
            is_continuous,
        };
        for (row, level) in of_row.into_iter().enumerate() {
            let place = (find(&raster.x, x[row]), find(&raster.y, y[row]));
            if let (Some(i), Some(j)) = place {
                raster.cells[j * raster.x.len() + i] = level;
            }
        }
        raster.fill();
        if !is_continuous {
            raster.join_rare();
        }
        raster
    }

    /// Makes one level of the rarest kinds where there are more than a legend can explain.
    fn join_rare(&mut self) {
        let mut counts = vec![0_usize; self.levels.len()];
        self.cells.iter().flatten().for_each(|k| counts[*k] += 1);
        let mut shown: Vec<usize> = (0..counts.len()).filter(|k| counts[*k] > 0).collect();
        if shown.len() <= MOST_KINDS {
            return;
        }
        shown.sort_by_key(|k| std::cmp::Reverse(counts[*k]));
        let rare = shown.split_off(MOST_KINDS - 1);
        self.levels.push(Level {
            text: "others".into(),
            color: OTHERS.into(),
        });
        let others = self.levels.len() - 1;
        let cells = self.cells.iter_mut().flatten();
        cells.filter(|k| rare.contains(k)).for_each(|k| *k = others);
    }

    /// Gives places without a level that of the nearest ones.
    fn fill(&mut self) {
        let (w, h) = (self.x.len(), self.y.len());
        let mut queue: VecDeque<usize> = (0..w * h).filter(|k| self.cells[*k].is_some()).collect();
        while let Some(k) = queue.pop_front() {
            let (i, j) = (k % w, k / w);
            let near = [
                (i > 0).then(|| k - 1),
                (i + 1 < w).then_some(k + 1),
                (j > 0).then(|| k - w),
                (j + 1 < h).then_some(k + w),
            ];
            for next in near.into_iter().flatten() {
                if self.cells[next].is_none() {
                    self.cells[next] = self.cells[k];
                    queue.push_back(next);
                }
            }
        }
    }

    /// The raster reduced to a number of columns and rows.
    pub fn thinned(&self, most: usize) -> Raster {
        let (i, j) = (kept(self.x.len(), most), kept(self.y.len(), most));
        let width = self.x.len();
        Raster {
            x: i.iter().map(|i| self.x[*i]).collect(),
            y: j.iter().map(|j| self.y[*j]).collect(),
            cells: (j.iter())
                .flat_map(|j| i.iter().map(move |i| self.cells[j * width + i]))
                .collect(),
            levels: self.levels.clone(),
            is_continuous: self.is_continuous,
        }
    }

    /// Levels that a legend explains.
    pub fn legend(&self) -> Vec<&Level> {
        if self.is_continuous {
            let last = self.levels.len().saturating_sub(1);
            let named = (0..NAMED).map(|k| k * last / (NAMED - 1));
            return named.filter_map(|k| self.levels.get(k)).collect();
        }
        let is_shown = |k: &usize| self.cells.contains(&Some(*k));
        (0..self.levels.len())
            .filter(is_shown)
            .map(|k| &self.levels[k])
            .collect()
    }
}

/// Borders of cells with these centres.
pub(super) fn edges(centres: &[f64]) -> Vec<f64> {
    let Some((first, last)) = centres.first().zip(centres.last()) else {
        return Vec::new();
    };
    if centres.len() == 1 {
        return vec![first - 0.5, first + 0.5];
    }
    let mut edges: Vec<f64> = centres.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
    edges.insert(0, 2.0 * first - edges[0]);
    edges.push(2.0 * last - edges[edges.len() - 1]);
    edges
}

/// Places that remain with a limited number.
fn kept(count: usize, most: usize) -> Vec<usize> {
    let shown = count.min(most);
    (0..shown)
        .map(|k| (2 * k + 1) * count / (2 * shown))
        .collect()
}

fn distinct(values: &[f64]) -> Vec<f64> {
    let mut list: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    list.sort_by(f64::total_cmp);
    let size = list.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    list.dedup_by(|a, b| (*a - *b).abs() <= 1e-12 * size);
    list
}

fn find(list: &[f64], value: f64) -> Option<usize> {
    if !value.is_finite() {
        return None;
    }
    let after = list.partition_point(|x| *x < value);
    let near = [after.checked_sub(1), Some(after)];
    let near = near.into_iter().flatten().filter(|k| *k < list.len());
    near.min_by(|a, b| {
        (list[*a] - value)
            .abs()
            .total_cmp(&(list[*b] - value).abs())
    })
}

/// Words, or whole numbers: a level each, named ones first.
fn kinds(values: &Values, names: &[(String, String)]) -> (Vec<Level>, Vec<Option<usize>>) {
    let words: Vec<String> = match values {
        Values::Text(words) => words.clone(),
        Values::Integer(numbers) => numbers.iter().map(i64::to_string).collect(),
        Values::Float(numbers) => numbers.iter().map(f64::to_string).collect(),
    };
    let (mut levels, mut places) = (Vec::<Level>::new(), HashMap::<String, usize>::new());
    let mut colors = KINDS.iter().cycle();
    let mut place = |text: &str, levels: &mut Vec<Level>| {
        let known = levels.iter().position(|level| level.text == text);
        known.unwrap_or_else(|| {
            let color = match text {
                "undecided" => UNKNOWN,
                _ => colors.next().copied().unwrap_or(UNKNOWN),
            };
            levels.push(Level {
                text: text.into(),
                color: color.into(),
            });
            levels.len() - 1
        })
    };
    for (word, text) in names {
        let level = place(text, &mut levels);
        places.insert(word.clone(), level);
    }
    let list = words.into_iter().map(|word| {
        let known = places.get(&word).copied();
        Some(known.unwrap_or_else(|| {
            let level = place(&word, &mut levels);
            places.insert(word, level);
            level
        }))
    });
    let list = list.collect();
    (levels, list)
}

/// Numbers: steps between the least and the largest.
fn steps(numbers: &[f64]) -> (Vec<Level>, Vec<Option<usize>>) {
    let finite = || numbers.iter().copied().filter(|x| x.is_finite());
    let low = finite().fold(f64::INFINITY, f64::min);
    let high = finite().fold(f64::NEG_INFINITY, f64::max);
    let span = (high - low).max(f64::MIN_POSITIVE);
    let level = |k: usize| {
        let share = k as f64 / (STEPS - 1) as f64;
        Level {
            text: format!("{:.3}", low + share * (high - low)),
            color: ramp(share),
        }
    };
    let place = |x: &f64| {
        let share = (x - low) / span;
        x.is_finite()
            .then(|| ((share * STEPS as f64) as usize).min(STEPS - 1))
    };
    let levels = match low.is_finite() {
        true => (0..STEPS).map(level).collect(),
        false => Vec::new(),
    };
    (levels, numbers.iter().map(place).collect())
}

fn ramp(share: f64) -> String {
    let place = share * (RAMP.len() - 1) as f64;
    let k = (place as usize).min(RAMP.len() - 2);
    let part = place - k as f64;
    let mix = |a: u8, b: u8| (f64::from(a) + part * (f64::from(b) - f64::from(a))).round() as u8;
    let (a, b) = (RAMP[k], RAMP[k + 1]);
    format!(
        "#{:02X}{:02X}{:02X}",
        mix(a.0, b.0),
        mix(a.1, b.1),
        mix(a.2, b.2)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_without_a_row_take_the_nearest_level() {
        let (x, y) = ([0.0, 2.0, 1.0, 0.0, 2.0], [0.0, 0.0, 0.0, 1.0, 1.0]);
        let values = Values::Integer(vec![1, 2, 2, 1, 0]);
        let names = [("1".into(), "one".into()), ("2".into(), "two".into())];
        let raster = Raster::new(&x, &y, &values, &names);
        assert_eq!((raster.x.len(), raster.y.len()), (3, 2));
        let of: Vec<&str> = raster
            .cells
            .iter()
            .map(|c| raster.levels[c.unwrap()].text.as_str())
            .collect();
        assert_eq!(of[..3], ["one", "two", "two"]);
        assert_eq!((of[3], of[5]), ("one", "0"));
        assert_eq!(edges(&raster.x), [-0.5, 0.5, 1.5, 2.5]);
        assert_eq!(raster.thinned(2).x.len(), 2);
    }

    #[test]
    fn rare_kinds_are_one() {
        let x: Vec<f64> = (0..40).map(f64::from).collect();
        let values = Values::Integer((0..40).map(|k| if k < 20 { k % 4 } else { k }).collect());
        let raster = Raster::new(&x, &vec![0.0; 40], &values, &[]);
        let legend = raster.legend();
        assert_eq!(legend.len(), MOST_KINDS);
        assert_eq!(legend[MOST_KINDS - 1].text, "others");
        assert_eq!(raster.levels[raster.cells[3].unwrap()].text, "3");
    }
}
