//! Judgement of fitted plants: recommendation, comparison with simpler models, and caveats.

mod change;
mod choose;
mod colour;
mod coupling;
mod cross;
mod good_for;
mod judged;
mod linear;
mod null;
mod off;
mod score;
mod scoring;
mod thrust;
mod verdict;
mod working;

pub(crate) use change::{Drift, NOT_WHITE, another_plant, widened};
pub use change::{LikelyChange, Part, PlantChange};
pub(crate) use choose::{Contender, choose, impossible, is_better};
pub(crate) use colour::LAGS;
pub use colour::box_pierce;
pub(crate) use coupling::{Coupling, turned};
pub(crate) use cross::left_out;
pub use good_for::{ConfirmedMotion, GoodFor, WorseTrial};
pub(crate) use good_for::{Tested, range};
pub(crate) use judged::Judged;
pub(crate) use linear::windows_of;
pub(crate) use null::Nulls;
pub use null::{NullModel, NullScore};
pub use off::{MayBeOff, OffBecause};
pub(crate) use off::{Number, may_be_off};
pub(crate) use score::{Expected, Outcome, Scored, records, score, scores};
pub use score::{PlantScore, Score, score_plant};
pub(crate) use scoring::scoring;
pub(crate) use thrust::{STILL, feedback, one_speed, reversed, still};
pub(crate) use verdict::{
    Judge, KNOWN_DRAG, KNOWN_MASS, MORE, WIDEST_DRAG, WIDEST_MASS, intervals, statement, vouched,
};
pub use verdict::{Trust, Verdict};
pub(crate) use working::{drag_at, working_speed};
