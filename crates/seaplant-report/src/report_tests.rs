//! Tests the complete report, from a fixture.

use std::collections::HashSet;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use seaplant::Method;
use seaplant::results::{Parameter, PlantResult, Results, Series};
use sha2::{Digest, Sha256};

use crate::figure::thrust;
use crate::fixture::Found;
use crate::number::{Rounded, with_minus};
use crate::visible::visible;
use crate::{Error, fixture, parse_results, render, results_schema, thrust_figure};

/// A written file.
struct File {
    path: String,
    bytes: Vec<u8>,
}

fn artifacts(found: &Found) -> Vec<File> {
    let mut files = Vec::new();
    let put = |artifact: &crate::Artifact<'_>| {
        let mut bytes = Vec::new();
        artifact.write_to(&mut bytes).expect("memory takes it");
        files.push(File { path: artifact.path.clone(), bytes });
        Ok::<(), Error>(())
    };
    render(&found.results, found.series.iter().cloned(), put).expect("the fixture renders");
    files
}

fn text<'a>(artifacts: &'a [File], path: &str) -> &'a str {
    let found = artifacts.iter().find(|artifact| artifact.path == path);
    let found = found.unwrap_or_else(|| panic!("no {path}"));
    std::str::from_utf8(&found.bytes).expect("text")
}

/// Returns the section of a page with this identifier.
fn section<'a>(html: &'a str, id: &str) -> &'a str {
    let section = html.split(&format!("<section id=\"{id}\"")).nth(1);
    section.and_then(|section| section.split("</section>").next()).expect("a section")
}

/// Unescapes HTML approximately as a browser does.
fn unescaped(html: &str) -> String {
    html.replace("<code>", "`")
        .replace("</code>", "`")
        .replace("&#x2f;", "/")
        .replace("&#x27;", "'")
        .replace("&quot;", "\"")
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&amp;", "&")
}

#[test]
fn names_of_users_are_escaped_everywhere() {
    let all = artifacts(&fixture::identification());
    let html = text(&all, "report.html");
    let elements = html.matches("<script").count();
    assert_eq!(elements, 3, "a name became an element, or a script is missing");
    assert!(unescaped(html).contains("<script>alert('x')</script>"));
    // Within the data of the charts, no name ends the element.
    let data = html.split("id=\"sheet\">").nth(1).and_then(|rest| rest.split("</script>").next());
    let data: serde_json::Value = serde_json::from_str(data.expect("data")).expect("JSON");
    let titles: Vec<&str> = data["charts"]
        .as_array()
        .expect("charts")
        .iter()
        .map(|chart| chart["title"].as_str().expect("a title"))
        .collect();
    assert!(titles.iter().any(|title| title.contains(&*visible(fixture::HOSTILE))), "{titles:?}");
    for artifact in &all {
        let safe = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "./-".contains(c);
        assert!(artifact.path.chars().all(safe), "{}", artifact.path);
        assert!(!artifact.path.contains("..") && !artifact.path.starts_with('/'));
    }
}

#[test]
fn no_file_of_a_report_contains_control_characters() {
    let all = artifacts(&fixture::identification());
    assert!(text(&all, "report.html").contains("\\u{1b}[2J\\u{202e}"));
    for File { path, bytes } in all {
        if !path.ends_with(".html") && !path.ends_with(".svg") {
            continue;
        }
        let text = String::from_utf8(bytes).expect("text");
        let obeyed = text.find(crate::is_obeyed).map(|at| &text[at.saturating_sub(80)..at]);
        assert_eq!(obeyed, None, "{path}");
        // Data for scripts also contain the number.
        assert!(!text.contains("\\u001b"), "{path}");
    }
}

#[test]
fn the_page_makes_no_network_requests() {
    let all = artifacts(&fixture::identification());
    let html = text(&all, "report.html");
    // The library's header contains its address, which is never contacted.
    let html = unescaped(html).replace("/*! https://github.com/leeoniya/uPlot", "");
    for word in ["http:", "https:", "src=", "url(", "@import", "<link", "<iframe", "fetch("] {
        assert!(!html.contains(word), "{word}");
    }
    let links = html.match_indices("href=\"").map(|(at, word)| &html[at + word.len()..]);
    let folders = ["#", "figures/", "series/", "tables/"];
    let is_near = |link: &str| folders.iter().any(|folder| link.starts_with(folder));
    assert!(links.into_iter().all(is_near));
}

#[test]
fn the_browser_runs_the_page_s_own_scripts_and_no_other() {
    let all = artifacts(&fixture::identification());
    let html = text(&all, "report.html");
    let policy = html.split("script-src").nth(1).expect("a policy");
    let policy = policy.split(';').next().expect("its end");
    let scripts: Vec<&str> = html.split("<script>").skip(1).collect();
    assert_eq!(scripts.len(), 2);
    for script in scripts {
        let script = script.split("</script>").next().expect("its end");
        let hash = STANDARD.encode(Sha256::digest(script));
        assert!(policy.contains(&format!("'sha256-{hash}'")), "{policy}");
    }
}

#[test]
fn the_library_of_charts_is_named_with_its_version_and_licence() {
    let all = artifacts(&fixture::identification());
    let html = text(&all, "report.html");
    let banner = html.split("uPlot (v").nth(1).expect("the library's own head");
    let version = banner.split(')').next().expect("its end");
    assert!(html.contains(&format!("drawn by uPlot {version},")), "{version}");
    assert!(html.contains(include_str!("../vendor/uplot/LICENSE")));
}

#[test]
fn every_file_that_the_page_names_is_written() {
    let all = artifacts(&fixture::identification());
    let html = unescaped(text(&all, "report.html"));
    let links = html.match_indices("href=\"").map(|(at, word)| &html[at + word.len()..]);
    let links: Vec<&str> = links.filter_map(|link| link.split('"').next()).collect();
    let files: Vec<&str> = links.into_iter().filter(|link| !link.starts_with('#')).collect();
    assert!(files.len() > 5, "{files:?}");
    for file in files {
        assert!(all.iter().any(|artifact| artifact.path == file), "{file}");
    }
}

#[test]
fn every_parameter_and_every_caveat_is_on_the_page() {
    let identification = fixture::identification();
    let all = artifacts(&identification);
    let html = unescaped(text(&all, "report.html"));
    let results = &identification.results;
    let plants = results.methods.values().flat_map(|methods| methods.values());
    let has = |parameter: &Parameter| {
        let Rounded { value, std, low95, high95 } = Rounded::of(parameter);
        for part in [value, std, low95, high95] {
            assert!(html.contains(&part), "{part} of {parameter:?}");
        }
    };
    for plant in plants.clone() {
        plant.parameters.values().map(Parameter::from).for_each(|x| has(&x));
        plant.nuisances.values().for_each(has);
    }
    let steady = results.steady.values();
    let pull = results.bollard_pull.iter();
    let caveats = plants
        .flat_map(|plant| &plant.caveats)
        .chain(steady.flat_map(|steady| &steady.caveats))
        .chain(pull.flat_map(|pull| &pull.caveats))
        .chain(&results.caveats);
    let folded = html.to_lowercase();
    for caveat in caveats {
        let message = visible(&with_minus(&caveat.message)).to_lowercase();
        assert!(folded.contains(&message), "{message}");
    }
    for failure in &results.failures {
        let message = visible(&with_minus(&failure.message)).to_lowercase();
        assert!(folded.contains(&message), "{message}");
    }
}

#[test]
fn sections_of_one_axis_and_of_several_have_the_same_parts() {
    let all = artifacts(&fixture::identification());
    let html = unescaped(text(&all, "report.html"));
    for name in ["surge", "sway-yaw"] {
        let section = section(&html, name);
        for part in [
            "<p class=\"verdict",
            "<caption>Parameters by method",
            "<caption>Prediction from forces alone",
            "<caption>Error e of each plant on each trial",
            "<caption>Every coefficient",
            "<caption>Nuisance parameters",
            "<caption>Which parts of the model the logs support",
            "<caption>Correlation of the estimates",
            "held-out\">\n<h3>Held-out trials",
        ] {
            assert!(section.contains(part), "{name}: {part}");
        }
    }
}

#[test]
fn every_method_of_a_plant_is_in_its_section() {
    let mut found = fixture::identification();
    let Results { plants, methods, .. } = &mut found.results;
    // One axis by a `[[plant]]`, beside its axis alone by the paper's method.
    let surge = plants.get_mut("surge").expect("it has surge");
    surge.alone = None;
    methods.entry("surge".to_owned()).or_default().insert(surge.method, surge.clone());
    let several = plants["sway-yaw"].clone();
    let adaptive = PlantResult { method: Method::Adaptive, ..several.clone() };
    let both = [(several.method, several), (adaptive.method, adaptive)];
    methods.insert("sway-yaw".to_owned(), both.into());
    let all = artifacts(&found);
    let html = unescaped(text(&all, "report.html"));
    for (name, other, charts) in [("surge", "The paper’s method", 1), ("sway-yaw", "Adaptive", 2)]
    {
        let section = section(&html, name);
        let table = section.split("<caption>Parameters by method").nth(1).expect("a table");
        let table = table.split("</table>").next().expect("its end");
        for method in ["Filter error", other] {
            assert!(table.contains(method), "{name}: {method}");
        }
        let of_intervals = format!("data-chart=\"intervals.{name}.");
        assert_eq!(section.matches(&of_intervals).count(), charts, "{name}");
    }
}

#[test]
fn figures_are_xml_and_png() {
    let all = artifacts(&fixture::identification());
    let (mut svgs, mut pngs) = (0, 0);
    for artifact in &all {
        if artifact.path.ends_with(".svg") {
            svgs += 1;
            let svg = std::str::from_utf8(&artifact.bytes).expect("text");
            let document = roxmltree::Document::parse(svg).expect("XML");
            let named = |name| {
                document
                    .descendants()
                    .any(|node| node.has_tag_name(("http://www.w3.org/2000/svg", name)))
            };
            assert!(named("title") && named("desc") && named("path"), "{}", artifact.path);
        } else if artifact.path.ends_with(".png") {
            pngs += 1;
            let decoder = png::Decoder::new(std::io::Cursor::new(&artifact.bytes));
            let mut reader = decoder.read_info().expect("PNG");
            let mut pixels = vec![0; reader.output_buffer_size().expect("fits memory")];
            let info = reader.next_frame(&mut pixels).expect("PNG");
            assert_eq!(info.width, 1280);
            let colours: HashSet<&[u8]> = pixels.chunks(3).collect();
            assert!(colours.len() > 10, "{} is blank", artifact.path);
        }
    }
    // One figure is of a method that is not recommended.
    assert_eq!((svgs, pngs), (9, 8));
}

#[test]
fn inline_figures_are_xml_too() {
    let all = artifacts(&fixture::identification());
    let html = text(&all, "report.html");
    let mut count = 0;
    for part in html.split("<div class=\"plot").skip(1) {
        let svg = part.split("</div>").next().and_then(|part| part.split_once('>'));
        let (_, svg) = svg.expect("closed");
        roxmltree::Document::parse(svg).expect("XML");
        count += 1;
    }
    assert_eq!(count, 9);
}

#[test]
fn results_go_through_json_and_back() {
    let identification = fixture::identification();
    let all = artifacts(&identification);
    let json = text(&all, "results.json");
    assert_eq!(parse_results(json).expect("reads"), identification.results);
    let value: serde_json::Value = serde_json::from_str(json).expect("JSON");
    let schema = results_schema();
    check_required(&schema, &schema, &value, "");
}

/// Checks that every key that the schema requires is present, recursively.
fn check_required(
    root: &serde_json::Value,
    schema: &serde_json::Value,
    value: &serde_json::Value,
    at: &str,
) {
    if let Some(reference) = schema["$ref"].as_str() {
        let target =
            root.pointer(reference.trim_start_matches('#')).expect("the reference leads somewhere");
        return check_required(root, target, value, at);
    }
    for key in schema["required"].as_array().into_iter().flatten() {
        let key = key.as_str().expect("a name");
        assert!(value.get(key).is_some(), "{at}: {key}");
    }
    if let Some(object) = value.as_object() {
        for (key, value) in object {
            let schema = schema["properties"].get(key).unwrap_or(&schema["additionalProperties"]);
            check_required(root, schema, value, &format!("{at}/{key}"));
        }
    }
    for (k, item) in value.as_array().into_iter().flatten().enumerate() {
        check_required(root, &schema["items"], item, &format!("{at}/{k}"));
    }
}

/// Returns the error of reading results in which the number at a path was changed.
fn after_change(pointer: &str, number: f64) -> String {
    let all = artifacts(&fixture::identification());
    let mut value: serde_json::Value =
        serde_json::from_str(text(&all, "results.json")).expect("JSON");
    *value.pointer_mut(pointer).expect("there is a number") = number.into();
    parse_results(&value.to_string()).expect_err("refused").to_string()
}

#[test]
fn repeated_numbers_must_agree() {
    let end = "; identify again, or restore the results as they were written";
    let sway = "plants.sway-yaw.parameters.\"mass.sway\"";
    for (pointer, number, expected) in [
        (
            "/plants/surge/by_axis/surge/mass/value",
            6485.1,
            "plants.surge.by_axis.surge.mass is 6485.1 ± 253".to_owned(),
        ),
        (
            "/plants/surge/alone/lumped/beta",
            -0.1,
            "but plants.surge.alone.lumped.beta is -0.1".to_owned(),
        ),
        (
            "/plants/surge/alone/lumped/mu",
            -0.1,
            "plants.surge.by_axis.surge.linear_drag is 0".to_owned(),
        ),
        (
            "/methods/surge/paper/alone/lumped/bias",
            0.0,
            "methods.surge.paper.by_axis.surge.bias_force is -255.5".to_owned(),
        ),
        (
            "/plants/sway-yaw/mass_matrix/value/0/0",
            181.0,
            format!("{sway} is 180, but plants.sway-yaw.mass_matrix of sway and sway is 181"),
        ),
        (
            "/plants/sway-yaw/parameters/sway: v/value",
            2.0,
            "but plants.sway-yaw.linear_damping of sway and sway is 0".to_owned(),
        ),
    ] {
        let message = after_change(pointer, number);
        assert!(message.contains(&expected) && message.ends_with(end), "{message}");
    }
}

#[test]
fn the_recommended_plant_is_that_of_its_method() {
    let all = artifacts(&fixture::identification());
    let mut value: serde_json::Value =
        serde_json::from_str(text(&all, "results.json")).expect("JSON");
    let plant = &mut value["plants"]["surge"];
    for key in ["value", "low95", "high95"] {
        let mass = &mut plant["by_axis"]["surge"]["mass"][key];
        *mass = (mass.as_f64().expect("a number") + 12970.2).into();
        let coefficient = &mut plant["parameters"]["mass.surge"][key];
        *coefficient = (coefficient.as_f64().expect("a number") + 12970.2).into();
        let added = &mut plant["by_axis"]["surge"]["added_mass"][key];
        *added = (added.as_f64().expect("a number") + 12970.2).into();
    }
    plant["mass_matrix"]["value"][0][0] = 25940.4.into();
    for (name, factor) in [("alpha", 0.5), ("beta", 0.5), ("mu", 0.5), ("bias", 0.5)] {
        let number = plant["alone"]["lumped"][name].as_f64().expect("a number");
        plant["alone"]["lumped"][name] = (factor * number).into();
    }
    let message = parse_results(&value.to_string()).expect_err("refused").to_string();
    let expected = "plants.surge.parameters.\"mass.surge\" is 25940.4, but methods.surge.";
    assert!(message.starts_with(expected), "{message}");
}

#[test]
fn standard_deviations_that_cannot_be_are_refused() {
    let message = after_change("/plants/surge/parameters/surge: |u|u/std", -61.0);
    assert!(
        message.starts_with(
            "plants.surge.parameters.\"surge: |u|u\".std is -61; a standard deviation is finite"
        ),
        "{message}"
    );
    // Its variance is infinite.
    let message = after_change("/plants/surge/nuisances/delay/std", 1e200);
    assert!(message.contains("nuisances.delay.std is 1"), "{message}");
    let message = after_change("/plants/sway-yaw/parameters/mass.sway/std", -1.0);
    assert!(message.contains("parameters.\"mass.sway\".std is -1"), "{message}");
}

#[test]
fn other_schemas_are_refused_by_name() {
    let refused = parse_results(r#"{"schema": "seaplant/results/1", "x": 1}"#);
    assert!(matches!(refused, Err(Error::Schema { ref found, .. }) if found.ends_with("/1")));
    assert!(matches!(parse_results("{}"), Err(Error::NoSchema)));
    assert!(matches!(parse_results("{"), Err(Error::Json { line: 1, .. })));
}

#[test]
fn series_have_a_head_and_every_sample() {
    let all = artifacts(&fixture::identification());
    let series: Vec<&File> = all.iter().filter(|a| a.path.starts_with("series/")).collect();
    assert_eq!(series.len(), 6);
    for artifact in series {
        let mut reader = csv::Reader::from_reader(&artifact.bytes[..]);
        let unit = if artifact.path.contains(".yaw.") { "rad/s" } else { "m/s" };
        let difference = format!("difference [{unit}]");
        assert_eq!(reader.headers().expect("a head")[4], *difference, "{}", artifact.path);
        let rows: Vec<[f64; 5]> = reader.deserialize().map(|row| row.expect("numbers")).collect();
        assert_eq!(rows.len(), 3000);
        assert!(rows.iter().all(|row| (row[3] - row[2] - row[4]).abs() < 1e-12));
    }
    let table = text(&all, "tables/table-5.csv");
    assert!(table.contains("surge,paper,false,") && table.lines().count() == 3);
    assert_eq!(text(&all, "tables/table-6.csv").lines().count(), 3);
}

#[test]
fn nothing_identified_still_makes_a_report() {
    let all = artifacts(&fixture::empty());
    let html = text(&all, "report.html");
    assert!(html.contains("No degree of freedom could be identified"));
    assert!(html.contains("What could not be done"));
    assert!(!all.iter().any(|artifact| artifact.path.starts_with("figures/")));
}

#[test]
fn a_campaign_of_steady_trials_alone_points_to_table_6() {
    let mut identification = fixture::identification();
    identification.results.plants.clear();
    identification.results.methods.clear();
    identification.series.retain(|series| matches!(series, Series::Steady(_)));
    let all = artifacts(&identification);
    let html = text(&all, "report.html");
    assert!(html.contains("Drag from steady trials is in <a href=\"#paper\">Table 6</a>"));
    assert!(html.contains("5660.6") && !html.contains("Table 5: plants"));
}

#[test]
fn paths_are_unique() {
    let all = artifacts(&fixture::identification());
    let paths: HashSet<&str> = all.iter().map(|artifact| artifact.path.as_str()).collect();
    assert_eq!(paths.len(), all.len());
}

#[test]
fn degenerate_series_make_figures() {
    let mut identification = fixture::identification();
    for (k, series) in identification.series.iter_mut().enumerate() {
        match series {
            Series::Comparison(figure) if k == 0 => {
                figure.comparison.measured.fill(0.0);
                figure.comparison.simulated.fill(0.0);
            }
            Series::Comparison(figure) if k == 1 => {
                figure.comparison.time_s.clear();
                figure.comparison.force.clear();
                figure.comparison.measured.clear();
                figure.comparison.simulated.clear();
            }
            Series::Comparison(_) => {}
            Series::Spectrum(spectrum) => {
                spectrum.force = Default::default();
                spectrum.velocity.amplitude.fill(0.0);
            }
            Series::Steady(steady) => {
                steady.position.clear();
                steady.position_time_s.clear();
            }
        }
    }
    let pull = identification.results.bollard_pull.as_mut().expect("fixture has one");
    pull.points.clear();
    let all = artifacts(&identification);
    assert!(!text(&all, "report.html").contains("NaN"));
}

#[test]
fn the_thrust_figure_can_be_drawn_alone() {
    let mut pull = fixture::bollard_pull();
    let figure = thrust_figure(&pull).expect("draws");
    assert!(figure.svg.starts_with(b"<svg") && figure.png.starts_with(b"\x89PNG"));
    pull.input_unit = "us".to_owned();
    pull.neutral = 1500.0;
    pull.points = vec![(1100.0, -30.0), (1500.0, 0.0), (1900.0, 40.0)];
    pull.deadband = Some(fixture::parameter(25.0, 2.0, "us"));
    let scene = thrust(&pull).expect("draws");
    assert!(scene.description.contains("deadband 25.0 ± 2.0 us"), "{}", scene.description);
}

#[test]
fn axes_that_were_identified_together_have_cards_and_their_doubts_are_in_the_summary() {
    let mut found = fixture::identification();
    found.results.plants.retain(|_, plant| !plant.is_alone());
    found.results.methods.clear();
    let all = artifacts(&found);
    let html = unescaped(text(&all, "report.html"));
    let summary = section(&html, "summary");
    assert_eq!(summary.matches("<figure class=\"thumbnail\">").count(), 2, "{summary}");
    for words in ["usable with care", "doubtful", "Added mass", "No moment acts on yaw"] {
        assert!(summary.contains(words), "{words}: {summary}");
    }
    for file in ["series/held-out.sway.sway-yaw.csv", "figures/held-out.yaw.sway-yaw.svg"] {
        assert!(all.iter().any(|artifact| artifact.path == file), "{file}");
    }
    // One chart of both axes, with its figures for print.
    let section = section(&html, "sway-yaw");
    assert_eq!(section.matches("data-chart=").count(), 1);
    assert_eq!(section.matches("class=\"plot still\"").count(), 2);
}
