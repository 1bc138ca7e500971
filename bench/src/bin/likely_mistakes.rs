//! The mistakes that logs show, whatever a plant of them predicts.
//!
//! `likely_mistakes CAMPAIGN ...` prints the number of each campaign, and its messages. It takes a second of a campaign
//! where `identify` takes a minute, so that false names are counted over hundreds of healthy logs.

use std::path::Path;

use anyhow::{Result, bail};
use seaplant::likely_mistakes;
use seaplant_campaign::Campaign;

fn main() -> Result<()> {
    let campaigns: Vec<String> = std::env::args().skip(1).collect();
    if campaigns.is_empty() {
        bail!("use: likely_mistakes CAMPAIGN ...");
    }
    for path in campaigns {
        let Campaign { vehicle, trials, .. } = Campaign::open(Path::new(&path))?;
        let found = likely_mistakes(&vehicle, &trials);
        println!("{path}: {}", found.len());
        found.iter().for_each(|mistake| println!("    {}", mistake.message));
    }
    Ok(())
}
