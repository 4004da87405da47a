//! One of several equal parts of a study.

use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Part `index` of `count`, the index from 1: every `count`-th run, so that neighbours, which cost alike, are spread evenly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// From 1.
    pub index: u64,
    /// Parts in all.
    pub count: u64,
}

impl Shard {
    /// Everything in one part.
    pub const WHOLE: Shard = Shard { index: 1, count: 1 };

    /// Place of a run among those of this part, from 0; `None` when it belongs to another part.
    pub fn place(self, run: u64) -> Option<u64> {
        (run % self.count == self.index - 1).then_some(run / self.count)
    }

    /// The run at a place.
    pub fn run(self, place: u64) -> u64 {
        place * self.count + self.index - 1
    }

    /// Number of runs of a study in this part.
    pub fn share(self, runs: u64) -> u64 {
        runs / self.count + u64::from(runs % self.count >= self.index)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let wanted = "wanted INDEX/COUNT with an index from 1, such as 2/8";
        let (index, count) = text.split_once('/').ok_or(wanted)?;
        let number = |text: &str| text.parse::<u64>().map_err(|_| wanted.to_string());
        let (index, count) = (number(index)?, number(count)?);
        if index == 0 {
            return Err("the index counts from 1".into());
        }
        if index > count {
            return Err(format!("there is no part {index} of {count}"));
        }
        Ok(Shard { index, count })
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_all_runs() {
        for (runs, count) in [(10, 3), (2, 5), (7, 7), (1_000_001, 4)] {
            let parts: Vec<Shard> = (1..=count).map(|index| Shard { index, count }).collect();
            let sum: u64 = parts.iter().map(|p| p.share(runs)).sum();
            assert_eq!(sum, runs);
            for run in 0..runs.min(100) {
                let own: Vec<&Shard> = parts.iter().filter(|p| p.place(run).is_some()).collect();
                assert_eq!(own.len(), 1);
                assert_eq!(own[0].run(own[0].place(run).unwrap()), run);
                assert!(own[0].place(run).unwrap() < own[0].share(runs));
            }
        }
    }

    #[test]
    fn parts_are_written_as_two_numbers() {
        assert_eq!("2/8".parse(), Ok(Shard { index: 2, count: 8 }));
        for text in ["", "2", "0/3", "4/3", "-1/3", "1/0", "a/b", "1/2/3"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
