//! Plants that no exporter writes unchanged.

use seaplant::exchange::{PlantFile, PlantModel};
use seaplant_export::{EXPORTERS, Error, Permission, export};

/// Returns a plant of six axes whose surge has these coefficients in addition to its mass.
fn plant(damping: &str) -> Result<PlantModel, seaplant::Error> {
    let rest: String = ["sway", "heave", "roll", "pitch", "yaw"]
        .map(|dof| format!("\"mass.{dof}\" = {{ value = 40.0, std = 1.0 }}\n"))
        .concat();
    let text = format!(
        "schema = \"seaplant/plant/1\"\nname = \"disc\"\nsource = \"worked by hand\"\n[coefficients]\n\"mass.surge\" = {{ value = 40.0, std = 1.0 }}\n{rest}{damping}\n"
    );
    toml::from_str::<PlantFile>(&text).expect("a table").model()
}

#[test]
fn negative_drag_stays_in_every_format_unless_it_is_forced_to_carry_the_reason() {
    for (damping, words) in [
        (r#""surge: |u|u" = { value = -30.0 }"#, "surge: quadratic drag is -30 "),
        (r#""surge: u" = { value = -3.0 }"#, "surge: linear drag is -3 "),
    ] {
        let model = plant(damping).expect("a plant");
        for exporter in EXPORTERS {
            let message = match export(exporter, &model, Permission::Checked) {
                Err(error @ Error::DoNotUse { .. }) => error.to_string(),
                other => panic!("{}: {other:?}", exporter.name()),
            };
            assert!(message.contains(words), "{message}");
            assert!(message.contains("check its sign, or fit other terms"), "{message}");
            if let Ok(made) = export(exporter, &model, Permission::Anyway) {
                let is_said = |note: &String| note.starts_with(&format!("DO NOT USE: {words}"));
                assert!(made.notes.iter().any(is_said), "{}: {:?}", exporter.name(), made.notes);
            }
        }
    }
}

#[test]
fn standard_deviations_that_cannot_be_are_refused_by_their_name() {
    let name = "coefficients.\"surge: |u|u\"";
    for std in ["-1.0", "inf", "nan", "1e200"] {
        let damping = format!("\"surge: |u|u\" = {{ value = 30.0, std = {std} }}");
        let message = plant(&damping).expect_err("refused").to_string();
        assert!(message.starts_with(&format!("{name}.std is ")), "{message}");
        assert!(
            message.ends_with("; it must be finite and not below zero, or left out"),
            "{message}"
        );
    }
    let message = plant("\"surge: |u|u\" = { value = 30.0, high95 = inf }").expect_err("refused");
    let expected = format!("{name}.high95 is inf; it must be finite, or left out");
    assert_eq!(message.to_string(), expected);
}
