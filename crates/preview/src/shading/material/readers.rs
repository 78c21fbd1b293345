//! The functions by which a shader reads packed constants, made from their declarations.
//!
//! Each takes `at`, the place where the struct's words begin in the buffer `material`. For the member `peak`
//! of a struct `ward` it is `ward_peak(at)`:
//!
//! | member | its function |
//! | --- | --- |
//! | numbers, integers, a flag | the value |
//! | a struct | the place where its words begin |
//! | an array | the same of an element, `ward_peak(at, k)` |
//! | a list | also `ward_peak_count(at)`, the number of elements |

use brdf::packed::{Layout, Shape};

/// The functions of these structs and of those in them, each once.
pub(super) fn readers(layouts: impl Iterator<Item = &'static Layout>) -> String {
    let mut found = Vec::new();
    layouts.for_each(|layout| collect(layout, &mut found));
    found.into_iter().map(of_struct).collect()
}

/// Appends a struct and those in it, unless they are known.
fn collect(layout: &'static Layout, found: &mut Vec<&'static Layout>) {
    if !found.contains(&layout) {
        found.push(layout);
        layout.members.iter().for_each(|member| collect_shape(&member.shape, found));
    }
}

fn collect_shape(shape: &Shape, found: &mut Vec<&'static Layout>) {
    match shape {
        Shape::Struct(layout) => collect(layout, found),
        Shape::Array(element, _) | Shape::List(element) => collect_shape(element, found),
        Shape::Floats(_) | Shape::Integers(_) | Shape::Flag => {}
    }
}

fn of_struct(layout: &Layout) -> String {
    let (mut text, mut offset) = (String::new(), 0);
    for member in layout.members {
        let name = format!("{}_{}", layout.name, member.name);
        text += &match member.shape {
            Shape::Array(element, _) => of_element(&name, element, offset),
            Shape::List(element) => {
                of_value(&format!("{name}_count"), &Shape::Integers(1), offset)
                    + &of_element(&name, element, offset + 1)
            }
            shape => of_value(&name, &shape, offset),
        };
        // A list is the last member, so no offset comes after it.
        offset += member.shape.words().unwrap_or(0);
    }
    text
}

fn of_value(name: &str, shape: &Shape, offset: u32) -> String {
    let (value_type, value) = read(shape, &|word| format!("at + {}u", offset + word));
    format!("fn {name}(at: u32) -> {value_type} {{ return {value}; }}\n")
}

fn of_element(name: &str, element: &Shape, offset: u32) -> String {
    let size = element.words().unwrap_or(0);
    let (value_type, value) = read(element, &|word| format!("at + {}u + {size}u * k", offset + word));
    format!("fn {name}(at: u32, k: u32) -> {value_type} {{ return {value}; }}\n")
}

/// The type of a value and the expression for it, given the place of each of its words.
fn read(shape: &Shape, place: &dyn Fn(u32) -> String) -> (String, String) {
    let parts = |count: u32, scalar: &str, part: &dyn Fn(u32) -> String| match count {
        1 => (scalar.to_owned(), part(0)),
        count => {
            let vector = format!("vec{count}{}", &scalar[..1]);
            let parts: Vec<_> = (0..count).map(part).collect();
            let value = format!("{vector}({})", parts.join(", "));
            (vector, value)
        }
    };
    match shape {
        Shape::Floats(count) => {
            parts(*count, "f32", &|word| format!("bitcast<f32>(material[{}])", place(word)))
        }
        Shape::Integers(count) => parts(*count, "u32", &|word| format!("material[{}]", place(word))),
        Shape::Flag => ("bool".into(), format!("material[{}] != 0u", place(0))),
        // The words of what an element holds are read by the functions of its own struct.
        Shape::Struct(_) | Shape::Array(..) | Shape::List(_) => ("u32".into(), place(0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brdf::packed::{Member, Packed as _};

    #[test]
    fn members_are_read_where_they_are_packed() {
        let layout = brdf::LafortuneConstants::SHAPE.layout().unwrap();
        let expected = "\
fn lafortune_diffuse(at: u32) -> vec3f { return vec3f(bitcast<f32>(material[at + 0u]), \
bitcast<f32>(material[at + 1u]), bitcast<f32>(material[at + 2u])); }
fn lafortune_lobes_count(at: u32) -> u32 { return material[at + 3u]; }
fn lafortune_lobes(at: u32, k: u32) -> u32 { return at + 4u + 6u * k; }
fn lafortune_lobe_cx(at: u32) -> f32 { return bitcast<f32>(material[at + 0u]); }
fn lafortune_lobe_cz(at: u32) -> f32 { return bitcast<f32>(material[at + 1u]); }
fn lafortune_lobe_n(at: u32) -> f32 { return bitcast<f32>(material[at + 2u]); }
fn lafortune_lobe_weight(at: u32) -> vec3f { return vec3f(bitcast<f32>(material[at + 3u]), \
bitcast<f32>(material[at + 4u]), bitcast<f32>(material[at + 5u])); }
";
        assert_eq!(readers([layout, layout].into_iter()), expected);
    }

    #[test]
    fn elements_of_arrays_and_flags_are_read() {
        const PAIRS: Shape = Shape::Array(&Shape::Integers(2), 8);
        const LAYOUT: Layout = Layout {
            name: "test",
            members: &[
                Member { name: "pairs", shape: PAIRS },
                Member { name: "is_metal", shape: Shape::Flag },
            ],
        };
        let expected = "\
fn test_pairs(at: u32, k: u32) -> vec2u { return vec2u(material[at + 0u + 2u * k], \
material[at + 1u + 2u * k]); }
fn test_is_metal(at: u32) -> bool { return material[at + 16u] != 0u; }
";
        assert_eq!(readers([&LAYOUT].into_iter()), expected);
    }
}
