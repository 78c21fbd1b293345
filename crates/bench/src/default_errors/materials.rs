//! The materials of the table.

/// A material of the table.
#[derive(Clone, Debug)]
pub struct Case {
    /// The name of its file.
    pub name: String,
    /// The text of its file.
    pub text: String,
    /// The measured BRDF beside it, by its name in the corpus.
    pub measured: Option<&'static str>,
    /// Roughness below 0.2: no map of P = 16 holds the reflection of a lamp.
    pub sharp: bool,
}

/// Gold at the wavelengths of red, green and blue.
const GOLD: &str = "n = [0.143, 0.375, 1.442]\nk = [3.983, 2.386, 1.603]";

/// All materials.
pub fn cases() -> Vec<Case> {
    let case = |name: String, text: String| Case { name, text, measured: None, sharp: false };
    let mut cases = Vec::new();
    for exponent in [10, 150] {
        cases.push(case(format!("phong-{exponent}"), format!("model = \"phong\"\nexponent = {exponent}")));
    }
    for sigma in [0.1, 0.15, 0.3, 0.5] {
        cases.push(case(format!("microfacet-{sigma}"), format!("model = \"microfacet\"\nsigma = {sigma}")));
    }
    for roughness in [0.1, 0.2, 0.3, 0.5, 1.0] {
        for (name, model) in [
            ("ggx", format!("model = \"ggx\"\n{GOLD}")),
            ("metal", "model = \"standard\"\nmetallic = 1\nbase_color = [1.0, 0.77, 0.34]".to_owned()),
            ("plastic", "model = \"standard\"\nbase_color = [0.5, 0.2, 0.05]".to_owned()),
        ] {
            let text = format!("{model}\nroughness = {roughness}");
            let name = format!("{name}-{roughness}");
            cases.push(Case { sharp: roughness < 0.2, ..case(name, text) });
        }
    }
    cases.push(case(
        "lafortune".to_owned(),
        "model = \"lafortune\"\ndiffuse = [0.3, 0.2, 0.1]\nlobes = [\n    \
         { cx = -1.0, cz = 0.95, n = 20, weight = 0.5 },\n    { cx = -0.95, cz = 1.0, n = 80, weight = 1.5 },\n]"
            .to_owned(),
    ));
    cases.push(case(
        "kajiya-kay-32".to_owned(),
        "model = \"kajiya-kay\"\nexponent = 32\nspecular = 0.25".to_owned(),
    ));
    for file in ["garnet_red", "krylon_blue"] {
        let text = format!("model = \"measured\"\nfile = \"../measured/{file}.brdf\"");
        cases.push(Case { measured: Some(file), ..case(file.replace('_', "-"), text) });
    }
    cases
}
