//! One irregularity of a channel, and its message.

use std::fmt;

/// An irregularity, with its numbers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Remark {
    Constant { value: String, count: usize },
    Sentinel { value: String, count: usize },
    ZeroFilled { runs: usize, samples: usize, first_s: f64 },
    Saturated { count: usize, of: usize, end: &'static str, value: String },
    Frozen { value: String, from_s: f64, to_s: f64, samples: usize, others: usize },
    Held { every_s: f64, logged_s: f64 },
    Clock,
    Wraps { times: usize, jump: String },
    Unwrapped { turns: String },
    LooksLikeDegrees { reaches: String },
    LooksLikeRadians { from: String, to: String },
    Irregular { median_s: f64, p95_s: f64 },
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Constant { value, count } => {
                write!(f, "constant: all {count} samples are {value}")
            }
            Self::Sentinel { value, count } => write!(
                f,
                "{count} samples are {value}, far from all others: probably a code for missing data; remove them from the log"
            ),
            Self::ZeroFilled { runs, samples, first_s } => write!(
                f,
                "zero-filled: {} in {}, exactly 0 between values far from it, first at {first_s:.2} s: dropouts, perhaps; leave them empty in the log",
                times(*samples, "sample", "samples"),
                times(*runs, "stretch", "stretches")
            ),
            Self::Saturated { count, of, end, value } => {
                write!(f, "saturated: {count} of {of} samples are exactly at the {end}, {value}")
            }
            Self::Frozen { value, from_s, to_s, samples, others } => {
                write!(
                    f,
                    "frozen: {value} from {from_s:.2} to {to_s:.2} s ({samples} samples), although it changes otherwise"
                )?;
                if *others > 0 {
                    write!(f, "; {} more", times(*others, "such stretch", "such stretches"))?;
                }
                Ok(())
            }
            Self::Held { every_s, logged_s } => write!(
                f,
                "changes every {every_s:.3} s though logged every {logged_s:.3} s: old samples are repeated, which looks like standstill and jumps; log each sample once"
            ),
            Self::Clock => {
                write!(f, "rises evenly with time: a clock or a counter, not a measurement")
            }
            Self::Wraps { times: count, jump } => write!(
                f,
                "wraps {} (jumps of about {jump}); Seaplant unwraps it",
                times(*count, "time", "times")
            ),
            Self::Unwrapped { turns } => {
                write!(f, "spans {turns} turns without a jump: it is unwrapped already")
            }
            Self::LooksLikeDegrees { reaches } => write!(
                f,
                "reaches {reaches}, so it looks like degrees; state unit = \"deg\" if it is"
            ),
            Self::LooksLikeRadians { from, to } => write!(
                f,
                "spans {from} to {to}, so it looks like radians; state unit = \"rad\" if it is"
            ),
            Self::Irregular { median_s, p95_s } => write!(
                f,
                "irregular sampling: every {median_s:.3} s in the median, but one interval in twenty is longer than {p95_s:.3} s"
            ),
        }
    }
}

fn times(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}
