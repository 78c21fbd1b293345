//! Cut, contradicting and damaged files: an error with the line or the byte.

use super::*;

fn spectral(rows: usize) -> String {
    let mut text = String::from("# made by a test\n3\n400 550 700\n");
    for i in 0..rows {
        let i = i as f64;
        text += &format!(
            "{:.4} 0 {:.4} {:.4} 0.1 0.2 0.15\n",
            (i * 0.61) % 1.5,
            (i * 0.37) % 1.5,
            (i * 1.1) % 3.1
        );
    }
    text
}

/// A name, a small whole file, and how many of its last bytes may be cut without anyone knowing: digits of
/// the last number.
fn small_files() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("a.binary", merl([3, 3, 4], model, |_| false)),
        ("a.brdf", spectral(16).into_bytes()),
        (
            "a.csv",
            table(model)
                .lines()
                .take(2 + 16)
                .map(|line| format!("{line}\n"))
                .collect::<String>()
                .into_bytes(),
        ),
        ("a.curet", curet("radians", 205, model).into_bytes()),
    ]
}

/// Text can be cut within its last number and still be whole to any reader; all other lengths are errors, for
/// each file has the fewest measurements that are read.
#[test]
fn every_truncated_length_is_an_error() {
    for (name, bytes) in small_files() {
        assert!(read(name, &bytes, None).is_ok(), "{name}");
        let text = name != "a.binary";
        let last = if text {
            bytes.trim_ascii_end().iter().rposition(|byte| b" ,".contains(byte)).unwrap() + 2
        } else {
            bytes.len()
        };
        for length in 0..last {
            let error =
                read(name, &bytes[..length], None).expect_err(&format!("{name} cut to {length} bytes"));
            assert!(!error.to_string().is_empty());
        }
    }
    let (name, mut bytes) = small_files().swap_remove(0);
    bytes.push(0);
    let error = read(name, &bytes, None).unwrap_err().to_string();
    assert_eq!(
        error,
        "merl: the header declares 3 x 3 x 4 entries of 24 bytes, 876 bytes in all; the file has 877"
    );
}

/// The error of a file with one thing changed.
fn error_with(name: &str, from: &str, to: &str) -> String {
    let (_, bytes) = small_files().into_iter().find(|(file, _)| *file == name).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    assert!(text.contains(from), "{name} holds no {from:?}: {text}");
    read(name, text.replacen(from, to, 1).as_bytes(), None).unwrap_err().to_string()
}

/// Anisotropic tables: a line of each form is damaged, and the whole is cut.
#[test]
fn damaged_anisotropic_tables_are_reported_with_their_line() {
    let angles = format!("theta_i,phi_i,theta_o,phi_o,r,g,b\n{}", "10,20,30,40,1,1,1\n".repeat(16));
    let vectors = format!("x_i,y_i,z_i,x_o,y_o,z_o,r,g,b\n{}", "0,0,1,1,0,2,1,1,1\n".repeat(16));
    let error = |text: &str| read("a.csv", text.as_bytes(), None).unwrap_err().to_string();
    let with = |text: &str, last: &str| error(&format!("{text}{last}\n"));
    assert_eq!(
        with(&angles, "10,20,95,0,1,1,1"),
        "table: line 18: theta_o is 95; expected 0 to 90 degrees from the normal"
    );
    assert_eq!(with(&angles, "10,NaN,9,0,1,1,1"), "table: line 18: phi_i is NaN; expected an angle");
    assert_eq!(
        with(&angles, "10,0,9,0,1,NaN,1"),
        "table: line 18: g is NaN; expected a finite number, 0 or more"
    );
    assert_eq!(
        with(&angles, "10,0,9,1,1,1"),
        "table: line 18: 6 values; expected 7 (theta_i,phi_i,theta_o,phi_o,r,g,b)"
    );
    assert_eq!(with(&vectors, "0,inf,1,1,0,2,1,1,1"), "table: line 18: y_i is inf; expected a finite number");
    for bad in ["0,0,0", "1,0,-1"] {
        let expected = format!(
            "table: line 18: the direction ({}) is not above the surface; expected a vector with z of 0 or more",
            bad.replace(',', ", ")
        );
        assert_eq!(with(&vectors, &format!("0,0,1,{bad},1,1,1")), expected);
    }
    let cut = angles.trim_end().rsplit_once('\n').unwrap().0;
    assert_eq!(error(cut), "table: 15 measurements; expected 16 or more");
    assert_eq!(error("theta_i,phi_i,theta_o,phi_o,r,g,b\n"), "table: 0 measurements; expected 16 or more");
}

#[test]
fn damaged_text_is_reported_with_its_line() {
    let header = "theta_i, theta_o, phi, r, g, b";
    for (name, from, to, expected) in [
        ("a.brdf", "\n3\n", "\n0\n", "cornell: line 2: 0 wavelengths; expected 1 to 1024"),
        ("a.brdf", "\n3\n", "\n999999999\n", "cornell: line 2: 999999999 wavelengths; expected 1 to 1024"),
        (
            "a.brdf",
            "\n3\n",
            "\nx\n",
            "cornell: line 2: \"x\" is not a number; expected the count of wavelengths",
        ),
        (
            "a.brdf",
            "400 550",
            "550 400",
            "cornell: line 3: wavelength 400; expected 3 rising wavelengths in nanometres, 100 to 10000",
        ),
        (
            "a.brdf",
            "400 550 700",
            "500 550 700",
            "cornell: the wavelengths run from 500 to 700 nm; expected them to span 450 to 630 nm at least",
        ),
        ("a.brdf", "0.2", "NaN", "cornell: line 4: the BRDF is NaN; expected a finite number, 0 or more"),
        ("a.brdf", "0.2", "-0.2", "cornell: line 4: the BRDF is -0.2; expected a finite number, 0 or more"),
        ("a.brdf", "0.2", "1e99", "cornell: line 4: the BRDF is 1e99; expected a finite number, 0 or more"),
        (
            "a.brdf",
            "0.6100",
            "1.7",
            "cornell: line 5: theta_i is 1.7; expected 0 to pi/2 radians from the normal",
        ),
        (
            "a.brdf",
            "0.6100",
            "-0.1",
            "cornell: line 5: theta_i is -0.1; expected 0 to pi/2 radians from the normal",
        ),
        (
            "a.csv",
            header,
            "a,b,c",
            "table: line 2: \"a,b,c\" stands first; expected the header \"theta_i,theta_o,phi,r,g,b\" or \
             \"theta_i,phi_i,theta_o,phi_o,r,g,b\" or \"x_i,y_i,z_i,x_o,y_o,z_o,r,g,b\"",
        ),
        (
            "a.csv",
            "\n0,0,15,",
            "\n91,0,15,",
            "table: line 4: theta_i is 91; expected 0 to 90 degrees from the normal",
        ),
        ("a.csv", "\n0,0,15,", "\n0,0,inf,", "table: line 4: phi is inf; expected an angle"),
        (
            "a.csv",
            "\n0,0,15,",
            "\n0,0,15,-1,",
            "table: line 4: 7 values; expected 6 (theta_i,theta_o,phi,r,g,b)",
        ),
        ("a.csv", "\n0,0,15,", "\n0,0,", "table: line 4: 5 values; expected 6 (theta_i,theta_o,phi,r,g,b)"),
        (
            "a.curet",
            "radians",
            "grads",
            "curet: line 1: \"grads\" stands first; expected the unit of the angles, \"degrees\" or \"radians\"",
        ),
        (
            "a.curet",
            "\n0 0 0 0.5 ",
            "\n2 0 0 0.5 ",
            "curet: line 3: theta_v is 2; expected 0 to pi/2 radians from the normal",
        ),
        (
            "a.curet",
            "\n0 0 0 0.5 ",
            "\n0 0 0 0.5 1 1 1\n0 0 0 0.5 ",
            "curet: line 208: more than 205 measurements; expected 205",
        ),
    ] {
        assert_eq!(error_with(name, from, to), expected);
    }
    let whole = spectral(16);
    let error =
        read("a.brdf", whole.trim_end().trim_end_matches("0.15").as_bytes(), None).unwrap_err().to_string();
    let expected = "cornell: line 19: the last measurement has 6 of 7 values (4 angles and 3 wavelengths)";
    assert_eq!(error, expected);
    let short = spectral(15);
    let error = read("a.brdf", short.as_bytes(), None).unwrap_err().to_string();
    assert_eq!(error, "cornell: 15 measurements; expected 16 or more");
    let error = read("a.csv", b"theta_i,theta_o,phi,r,g,b\n\xff", None).unwrap_err().to_string();
    assert_eq!(error, "table: byte 26 is not text; expected UTF-8");
}

#[test]
fn damaged_merl_is_reported_with_its_byte() {
    let whole = merl([3, 3, 4], model, |_| false);
    let with = |at: usize, bytes: &[u8]| {
        let mut file = whole.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        read("a.binary", &file, None).unwrap_err().to_string()
    };
    assert_eq!(
        with(12 + 8 * 5, &f64::NAN.to_le_bytes()),
        "merl: byte 52: the value is NaN; expected a finite number, negative where nothing was measured"
    );
    for (dim, text) in [(0, "0 x 3 x 4"), (-3, "-3 x 3 x 4")] {
        let expected = format!("merl: bytes 0 to 11 declare a table of {text}; expected 90 x 90 x 180");
        assert_eq!(with(0, &i32::to_le_bytes(dim)), expected);
    }
    let huge = [i32::MAX.to_le_bytes(); 3];
    assert!(with(0, huge.as_flattened()).contains("more than 16777216 entries"));
    assert!(
        with(0, &16_000i32.to_le_bytes())
            .starts_with("merl: the header declares 16000 x 3 x 4 entries of 24 bytes")
    );
    let turn = [90i32, 90, 360].map(i32::to_le_bytes);
    assert!(with(0, turn.as_flattened()).contains("a full turn of phi_d"));
}
