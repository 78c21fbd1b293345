//! Constants of formulas, packed into words of 32 bits for renderers.
//!
//! A formula has constants that depend on the parameters of a material alone. `packed!` declares them once:
//!
//! ```ignore
//! packed! {
//!     /// The constants of `ward`.
//!     pub struct WardConstants as ward {
//!         /// The roughness along and across the tangent.
//!         roughness: Vec2,
//!         /// specular / (pi a_x a_y).
//!         specular: Vec3,
//!     }
//! }
//! ```
//!
//! The declaration makes the struct, whose members a formula in Rust reads by name, and its [`Layout`]: the
//! names, and the shapes of the members in the order of their words. From the layout a renderer makes what
//! reads the same members in a shader. So nothing but this module counts words.

use std::sync::Arc;

use glam::{DVec2, DVec3, DVec4, UVec3, UVec4, Vec2, Vec3, Vec4};

/// A value that can be packed into words.
pub trait Packed {
    /// Which words a value of this type becomes.
    const SHAPE: Shape;

    /// Appends its words.
    fn pack(&self, words: &mut Vec<u32>);
}

/// The words that a packed value becomes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// So many numbers, 1 to 4, each the bits of its f32.
    Floats(u32),
    /// So many integers, 1 to 4.
    Integers(u32),
    /// 1 for true, 0 for false.
    Flag,
    /// The members of a struct, one after the other.
    Struct(&'static Layout),
    /// So many elements of one shape.
    Array(&'static Shape, u32),
    /// The number of elements, and these. A list is the last member of a struct, which is the last of any
    /// other.
    List(&'static Shape),
}

impl Shape {
    /// The declaration of a struct; `None` of another shape.
    pub fn layout(&self) -> Option<&'static Layout> {
        match self {
            Self::Struct(layout) => Some(layout),
            _ => None,
        }
    }

    /// The number of words; `None` if it depends on the value, as that of a list does.
    pub fn words(&self) -> Option<u32> {
        match self {
            Self::Floats(count) | Self::Integers(count) => Some(*count),
            Self::Flag => Some(1),
            Self::Struct(layout) => layout.members.iter().map(|member| member.shape.words()).sum(),
            Self::Array(element, count) => Some(element.words()? * count),
            Self::List(_) => None,
        }
    }
}

/// The declaration of a packed struct.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// The name of the struct for shaders.
    pub name: &'static str,
    /// The members in the order of their words.
    pub members: &'static [Member],
}

/// A member of a packed struct.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Member {
    /// The name, the same in Rust and in shaders.
    pub name: &'static str,
    /// Which words a value of this type becomes.
    pub shape: Shape,
}

/// Declares a packed struct: its name in Rust and, after `as`, in shaders.
macro_rules! packed {
    (
        $(#[$doc:meta])*
        $vis:vis struct $name:ident as $of_shader:ident {
            $($(#[$member_doc:meta])* $member:ident: $type:ty,)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq)]
        $vis struct $name {
            $($(#[$member_doc])* $vis $member: $type,)*
        }

        impl $crate::packed::Packed for $name {
            const SHAPE: $crate::packed::Shape = $crate::packed::Shape::Struct(&$crate::packed::Layout {
                name: stringify!($of_shader),
                members: &[$($crate::packed::Member {
                    name: stringify!($member),
                    shape: <$type as $crate::packed::Packed>::SHAPE,
                },)*],
            });

            fn pack(&self, words: &mut Vec<u32>) {
                $($crate::packed::Packed::pack(&self.$member, words);)*
            }
        }
    };
}
pub(crate) use packed;

macro_rules! vectors {
    ($($vector:ty: $shape:expr;)*) => {
        $(impl Packed for $vector {
            const SHAPE: Shape = $shape;

            fn pack(&self, words: &mut Vec<u32>) {
                self.to_array().iter().for_each(|part| part.pack(words));
            }
        })*
    };
}
vectors! {
    Vec2: Shape::Floats(2);
    Vec3: Shape::Floats(3);
    Vec4: Shape::Floats(4);
    UVec3: Shape::Integers(3);
    UVec4: Shape::Integers(4);
}

impl Packed for f32 {
    const SHAPE: Shape = Shape::Floats(1);

    fn pack(&self, words: &mut Vec<u32>) {
        words.push(self.to_bits());
    }
}

impl Packed for u32 {
    const SHAPE: Shape = Shape::Integers(1);

    fn pack(&self, words: &mut Vec<u32>) {
        words.push(*self);
    }
}

impl Packed for bool {
    const SHAPE: Shape = Shape::Flag;

    fn pack(&self, words: &mut Vec<u32>) {
        words.push(u32::from(*self));
    }
}

impl<T: Packed, const N: usize> Packed for [T; N] {
    const SHAPE: Shape = Shape::Array(&T::SHAPE, N as u32);

    fn pack(&self, words: &mut Vec<u32>) {
        self.iter().for_each(|element| element.pack(words));
    }
}

impl<T: Packed> Packed for Vec<T> {
    const SHAPE: Shape = Shape::List(&T::SHAPE);

    fn pack(&self, words: &mut Vec<u32>) {
        words.push(self.len() as u32);
        self.iter().for_each(|element| element.pack(words));
    }
}

/// The values of a measured table, RGB, which its constants share with the table.
impl Packed for Arc<[[f32; 3]]> {
    const SHAPE: Shape = Shape::List(&Vec3::SHAPE);

    fn pack(&self, words: &mut Vec<u32>) {
        words.push(self.len() as u32);
        words.extend(self.as_flattened().iter().map(|value| value.to_bits()));
    }
}

/// Two numbers, rounded.
pub(crate) fn two(pair: [f64; 2]) -> Vec2 {
    DVec2::from_array(pair).as_vec2()
}

/// A colour, rounded.
pub(crate) fn rgb(colour: [f64; 3]) -> Vec3 {
    DVec3::from_array(colour).as_vec3()
}

/// Four numbers, rounded.
pub(crate) fn four(numbers: [f64; 4]) -> Vec4 {
    DVec4::from_array(numbers).as_vec4()
}

#[cfg(test)]
mod tests {
    use super::*;

    packed! {
        /// One of every shape.
        struct Outer as outer {
            /// A number.
            number: f32,
            /// A struct.
            inner: Inner,
            /// An array.
            pairs: [Vec2; 2],
            /// A list.
            list: Vec<Inner>,
        }
    }
    packed! {
        /// Integers.
        struct Inner as inner {
            /// Whether.
            is_metal: bool,
            /// A size.
            size: UVec3,
        }
    }

    #[test]
    fn members_are_packed_in_their_order() {
        let inner = |is_metal: bool, x: u32| Inner { is_metal, size: UVec3::new(x, x + 1, x + 2) };
        let outer = Outer {
            number: 1.5,
            inner: inner(true, 7),
            pairs: [Vec2::new(0.25, 0.5), Vec2::new(2.0, 4.0)],
            list: vec![inner(false, 10), inner(true, 20)],
        };
        let mut words = Vec::new();
        outer.pack(&mut words);
        let bits = |value: f32| value.to_bits();
        let head = [bits(1.5), 1, 7, 8, 9, bits(0.25), bits(0.5), bits(2.0), bits(4.0)];
        assert_eq!(words, [&head[..], &[2], &[0, 10, 11, 12], &[1, 20, 21, 22]].concat());
    }

    #[test]
    fn a_layout_has_the_names_and_shapes_of_the_declaration() {
        let layout = Outer::SHAPE.layout().unwrap();
        let members = layout.members.iter().map(|member| (member.name, member.shape.words()));
        let expected = [("number", Some(1)), ("inner", Some(4)), ("pairs", Some(4)), ("list", None)];
        assert_eq!((layout.name, members.collect::<Vec<_>>()), ("outer", expected.to_vec()));
        assert_eq!((Inner::SHAPE.words(), Outer::SHAPE.words()), (Some(4), None));
    }
}
