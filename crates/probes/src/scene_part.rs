//! What a computation reads of a scene: the rest is taken away, so that a change there is none of its inputs.

use std::collections::BTreeMap;

use crate::material::{Alpha, Emission, Material};
use crate::scene::{Corner, Part, Scene, SceneParts};
use crate::texture::{Texture, TextureUse};

/// What of a scene is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScenePart {
    /// Everything.
    All,
    /// What places of probes depend on: the triangles, which of them have two sides, which rays pass them,
    /// and the boxes and points. All surfaces are white.
    Shape,
    /// What the transport from the sky and from emissive materials depends on: surfaces, with a radiance of 1
    /// for each of these materials. Lamps, boxes and points are
    /// missing.
    Surfaces,
    /// What the transport from lamps depends on: surfaces that emit nothing, and the lamps with a colour and
    /// an intensity of 1.
    Lamps,
}

impl Scene {
    /// A part of the scene, as a scene. That of a part is itself.
    #[must_use]
    pub fn part(&self, part: ScenePart) -> Self {
        let parts = match part {
            ScenePart::All => self.parts().clone(),
            ScenePart::Shape => shape(self.parts()),
            ScenePart::Surfaces => surfaces(self.parts()),
            ScenePart::Lamps => lamps(self.parts()),
        };
        Self::of_checked(parts)
    }
}

/// One node without a name: where triangles come from changes no light.
fn nameless(parts: &SceneParts) -> Vec<Part> {
    vec![Part { name: String::new(), triangles: parts.triangles.len() }]
}

fn surfaces(parts: &SceneParts) -> SceneParts {
    let material = |material: &Material| {
        let mut own = material.clone();
        own.name.clear();
        own.emission = material.emission.map(|emission| Emission { radiance: [1.0; 3], ..emission });
        if own.is_unlit && own.transmission == 0.0 {
            own.base[..3].fill(1.0);
        }
        own
    };
    SceneParts {
        materials: parts.materials.iter().map(material).collect(),
        lamps: Vec::new(),
        boxes: Vec::new(),
        points: Vec::new(),
        parts: nameless(parts),
        ..parts.clone()
    }
}

fn lamps(parts: &SceneParts) -> SceneParts {
    let mut lit = surfaces(parts);
    lit.materials.iter_mut().for_each(|material| material.emission = None);
    lit.lamps = parts.lamps.clone();
    for lamp in &mut lit.lamps {
        (lamp.color, lamp.intensity) = ([1.0; 3], 1.0);
    }
    lit
}

fn shape(parts: &SceneParts) -> SceneParts {
    let mut textures: Vec<Texture> = Vec::new();
    let mut places = BTreeMap::new();
    let mut kept = |how: &TextureUse| {
        let place = *places.entry(how.texture).or_insert_with(|| {
            let texture = &parts.textures[how.texture as usize];
            let white = |texel: &[u16; 4]| [u16::MAX, u16::MAX, u16::MAX, texel[3]];
            let texels = texture.texels().iter().map(white).collect();
            textures.extend(Texture::new(texture.size(), texels));
            textures.len() as u32 - 1
        });
        TextureUse { texture: place, ..*how }
    };
    let mut material = |material: &Material| {
        let has_alpha = material.alpha != Alpha::Opaque;
        Material {
            name: material.name.clone(),
            base: [1.0, 1.0, 1.0, if has_alpha { material.base[3] } else { 1.0 }],
            base_texture: material.base_texture.as_ref().filter(|_| has_alpha).map(&mut kept),
            alpha: material.alpha,
            transmission: material.transmission,
            is_double_sided: material.is_double_sided,
            ..Material::default()
        }
    };
    let materials: Vec<Material> = parts.materials.iter().map(&mut material).collect();
    // Only the corners of surfaces with alpha are read.
    let (mut attributes, mut attributes_of, mut attribute_places) = (Vec::new(), Vec::new(), BTreeMap::new());
    for (&material, &at) in parts.material_of.iter().zip(&parts.attributes_of) {
        let corners = parts.attributes.get(at as usize);
        let corners = corners.filter(|_| parts.materials[material as usize].alpha != Alpha::Opaque);
        attributes_of.push(match corners {
            None => SceneParts::NONE,
            Some(corners) => *attribute_places.entry(at).or_insert_with(|| {
                attributes.push(corners.map(|Corner { color: [.., alpha], base, .. }| Corner {
                    color: [1.0, 1.0, 1.0, alpha],
                    base,
                    ..Corner::default()
                }));
                attributes.len() as u32 - 1
            }),
        });
    }
    SceneParts {
        attributes,
        attributes_of,
        materials,
        textures,
        lamps: Vec::new(),
        triangles: parts.triangles.clone(),
        material_of: parts.material_of.clone(),
        parts: parts.parts.clone(),
        boxes: parts.boxes.clone(),
        points: parts.points.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lamp::{Lamp, LampKind};
    use crate::scene::NamedBox;
    use brdf::Wrap;

    /// A glowing sheet, a leaf with a mask, and a lamp.
    fn scene() -> Scene {
        let how = |texture| TextureUse { texture, wrap: [Wrap::Repeat; 2], is_nearest: false };
        let texture = |code| Texture::new([1, 1], vec![[code, 5, 6, 7]]).unwrap();
        let glow = Material {
            name: "glow".into(),
            base_texture: Some(how(0)),
            emission: Some(Emission { radiance: [3.0, 2.0, 1.0], texture: None }),
            ..Material::default()
        };
        let leaf = Material {
            name: "leaf".into(),
            base: [0.1, 0.5, 0.1, 0.9],
            base_texture: Some(how(1)),
            alpha: Alpha::Mask(0.5),
            is_double_sided: true,
            ..Material::default()
        };
        let lamp = Lamp {
            name: "lamp".into(),
            kind: LampKind::Point,
            position: [0.0, 0.0, 3.0],
            direction: [1.0, 0.0, 0.0],
            color: [1.0, 0.5, 0.25],
            intensity: 60.0,
            range: None,
        };
        let corner = Corner { color: [0.5, 0.5, 0.5, 0.75], base: [0.25; 2], ..Corner::default() };
        Scene::new(SceneParts {
            triangles: vec![[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]; 2],
            attributes: vec![[Corner::default(); 3], [corner; 3]],
            attributes_of: vec![0, 1],
            material_of: vec![0, 1],
            materials: vec![glow, leaf],
            textures: vec![texture(3), texture(4)],
            lamps: vec![lamp],
            parts: vec![Part { name: "floor".into(), triangles: 2 }],
            boxes: vec![NamedBox { name: "box".into(), bounds: [[0.0; 3], [1.0; 3]] }],
            points: vec![[0.5; 3]],
        })
        .unwrap()
    }

    /// What changes, and whether each of shape, surfaces and lamps stays as it was.
    type Case<'a> = (&'a str, &'a dyn Fn(&mut SceneParts), [bool; 3]);

    #[test]
    fn a_part_lacks_what_its_reader_does_not_read() {
        let whole = scene();
        let parts = [ScenePart::All, ScenePart::Shape, ScenePart::Surfaces, ScenePart::Lamps];
        for part in parts {
            let scene = whole.part(part);
            assert_eq!(scene.part(part), scene);
            assert_eq!(Scene::new(scene.parts().clone()).unwrap(), scene);
        }
        let of = |change: &dyn Fn(&mut SceneParts), part| {
            let mut parts = whole.parts().clone();
            change(&mut parts);
            Scene::new(parts).unwrap().part(part) == whole.part(part)
        };
        let cases: [Case<'_>; 10] = [
            ("a lamp's colour", &|parts| parts.lamps[0].color = [1.0; 3], [true, true, true]),
            ("a lamp's intensity", &|parts| parts.lamps[0].intensity = 0.0, [true, true, true]),
            ("a lamp's place", &|parts| parts.lamps[0].position[0] = 1.0, [true, true, false]),
            (
                "the strength of emission",
                &|parts| {
                    let texture = None;
                    parts.materials[0].emission = Some(Emission { radiance: [9.0; 3], texture });
                },
                [true, true, true],
            ),
            ("an albedo", &|parts| parts.materials[0].base[0] = 0.5, [true, false, false]),
            (
                "a texture",
                &|parts| parts.textures[0] = Texture::new([1, 1], vec![[9; 4]]).unwrap(),
                [true, false, false],
            ),
            ("a mask", &|parts| parts.materials[1].base[3] = 0.25, [false, false, false]),
            ("a triangle", &|parts| parts.triangles[1][0][2] = 0.5, [false, false, false]),
            ("a box", &|parts| parts.boxes[0].bounds[1][0] = 2.0, [false, true, true]),
            ("a point", &|parts| parts.points[0][0] = 2.0, [false, true, true]),
        ];
        for (what, change, expected) in cases {
            let found =
                [ScenePart::Shape, ScenePart::Surfaces, ScenePart::Lamps].map(|part| of(change, part));
            assert_eq!(found, expected, "{what}");
        }
        assert_eq!(whole.part(ScenePart::Surfaces).emitters(), whole.emitters());
    }
}
