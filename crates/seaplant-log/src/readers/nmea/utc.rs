//! UTC from sentences that contain it, interpolated for the sentences between.

use jiff::civil::Date;
use jiff::tz::TimeZone;

use super::tables::number;

const DAY_S: f64 = 86_400.0;

/// UTC in a sentence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Utc {
    /// Since midnight, s.
    pub(super) time_s: f64,
    /// Midnight since 1970, s.
    pub(super) date_s: Option<f64>,
}

impl Utc {
    /// Reads the UTC from the fields of a sentence of some kind.
    pub(super) fn read(kind: &str, fields: &[&str]) -> Option<Self> {
        let field = |at: usize| fields.get(at).copied().unwrap_or_default();
        let (time, date) = match kind {
            "RMC" if field(1) == "A" => (field(0), Some(date(field(8))?)),
            "ZDA" => (field(0), Some(day(field(3), field(2), field(1))?)),
            "GGA" if !matches!(field(5), "" | "0") => (field(0), None),
            "GLL" if field(5) == "A" => (field(4), None),
            "PASHR" if field(2) == "T" => (field(0), None),
            _ => return None,
        };
        Some(Self { time_s: time_of_day(time)?, date_s: date })
    }

    /// Returns the time in seconds since 1970.
    pub(super) fn since_1970_s(self) -> Option<f64> {
        Some(self.date_s? + self.time_s)
    }
}

/// Parses `hhmmss.sss`.
fn time_of_day(text: &str) -> Option<f64> {
    let whole = text.get(..6).filter(|text| text.bytes().all(|b| b.is_ascii_digit()))?;
    let two = |at: usize| whole[at..at + 2].parse::<u32>().ok();
    let (hour, minute, second) = (two(0)?, two(2)?, number(&text[4..]));
    let is_time = hour < 24 && minute < 60 && (0.0..61.0).contains(&second);
    is_time.then(|| f64::from(3600 * hour + 60 * minute) + second)
}

/// Parses `ddmmyy`.
fn date(text: &str) -> Option<f64> {
    let (of_month, month, year) = (text.get(..2)?, text.get(2..4)?, text.get(4..6)?);
    let century = if year < "80" { "20" } else { "19" };
    day(&format!("{century}{year}"), month, of_month)
}

/// Returns the midnight at the start of a day, in seconds since 1970.
fn day(year: &str, month: &str, of_month: &str) -> Option<f64> {
    let date = Date::new(year.parse().ok()?, month.parse().ok()?, of_month.parse().ok()?).ok()?;
    Some(date.to_zoned(TimeZone::UTC).ok()?.timestamp().as_second() as f64)
}

/// Times by the order of sentences.
pub(super) struct Course {
    /// Sentences that contain UTC, and the UTC, s.
    own: Vec<(usize, f64)>,
    /// Those of them at which it increases.
    ahead: Vec<(usize, f64)>,
    /// True if times count from 1970, otherwise from the first midnight.
    pub(super) dated: bool,
}

/// Sentences between two whose UTC differs by more have no time, s.
pub(super) const FURTHEST_S: f64 = 2.5;

impl Course {
    /// Builds the time course from the UTC in numbered sentences; `None` if there is none.
    pub(super) fn new(said: &[(usize, Utc)]) -> Option<Self> {
        let known = said.iter().find_map(|(_, utc)| Some((utc.date_s?, utc.time_s)));
        let dated = known.is_some();
        let mut before = known.unwrap_or((0.0, said.first()?.1.time_s));
        let mut own = Vec::with_capacity(said.len());
        for &(number, utc) in said {
            let date_s = utc.date_s.unwrap_or_else(|| nearest(before, utc.time_s));
            before = (date_s, utc.time_s);
            own.push((number, date_s + utc.time_s));
        }
        let mut ahead: Vec<(usize, f64)> = Vec::new();
        for &(number, time) in &own {
            if ahead.last().is_none_or(|&(_, latest)| time > latest) {
                ahead.push((number, time));
            }
        }
        Some(Self { own, ahead, dated })
    }

    /// Returns the time of a sentence, s: its own, or interpolated between two others; else `NaN`.
    pub(super) fn time(&self, number: usize) -> f64 {
        if let Ok(found) = self.own.binary_search_by_key(&number, |&(number, _)| number) {
            return self.own[found].1;
        }
        let after = self.ahead.partition_point(|&(ahead, _)| ahead < number);
        let Some([from, to]) =
            after.checked_sub(1).and_then(|k| self.ahead.get(k..=after)?.first_chunk())
        else {
            return f64::NAN;
        };
        let (span_s, part) = (to.1 - from.1, (number - from.0) as f64 / (to.0 - from.0) as f64);
        if span_s > FURTHEST_S { f64::NAN } else { from.1 + part * span_s }
    }

    /// Returns the latest time, s.
    pub(super) fn last_s(&self) -> Option<f64> {
        self.ahead.last().map(|&(_, time)| time)
    }

    /// Returns the largest time difference between two sentences with UTC across which others are
    /// interpolated, s.
    pub(super) fn span_s(&self) -> f64 {
        let spans = self.ahead.windows(2).map(|w| w[1].1 - w[0].1);
        spans.filter(|span| *span <= FURTHEST_S).fold(0.0, f64::max)
    }
}

/// Returns the midnight that brings a time of day closest to a time of day with known midnight.
fn nearest(known: (f64, f64), time_s: f64) -> f64 {
    let (date_s, known_s) = known;
    match time_s - known_s {
        ahead if ahead > 0.5 * DAY_S => date_s - DAY_S,
        ahead if ahead < -0.5 * DAY_S => date_s + DAY_S,
        _ => date_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences_between_have_times_between() {
        let at = |time_s: f64, date_s: Option<f64>| Utc { time_s, date_s };
        let day = 1_000_000.0 * DAY_S;
        let said = [
            (1, at(86_399.0, None)),
            (5, at(0.0, Some(day))),
            (6, at(0.0, None)),
            (9, at(2.0, None)),
            (12, at(9.0, None)),
        ];
        let course = Course::new(&said).unwrap();
        assert!(course.dated);
        let times: Vec<f64> = [1, 3, 5, 6, 7, 9, 12].map(|k| course.time(k) - day).into();
        assert_eq!(times, [-1.0, -0.5, 0.0, 0.0, 1.0, 2.0, 9.0]);
        assert!([0, 10, 13].iter().all(|&k| course.time(k).is_nan()));
        assert_eq!((course.last_s(), course.span_s()), (Some(day + 9.0), 2.0));
        assert!(Course::new(&[]).is_none());
    }
}
