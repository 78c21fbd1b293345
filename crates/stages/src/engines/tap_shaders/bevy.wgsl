// Compact reflection maps in Bevy. The text was written by Specula for one light and one material.

#import bevy_pbr::{
    forward_io::{FragmentOutput, VertexOutput},
    mesh_view_bindings::view,
    pbr_fragment::pbr_input_from_standard_material,
    pbr_functions::{alpha_discard, apply_pbr_lighting, main_pass_post_lighting_processing},
}

@group(#{MATERIAL_BIND_GROUP}) @binding(100) var tap_levels: texture_cube_array<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(101) var tap_sampler: sampler;
@group(#{MATERIAL_BIND_GROUP}) @binding(102) var tap_normals: texture_cube_array<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(103) var tap_table: texture_2d<f32>;

__FUNCTIONS__
// Candelas per square metre of a radiance of 1, as `intensity` of an EnvironmentMapLight.
const TAP_LUMINANCE: f32 = 1000.0;

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> FragmentOutput {
    var pbr_input = pbr_input_from_standard_material(in, is_front);
    pbr_input.material.base_color = alpha_discard(pbr_input.material, pbr_input.material.base_color);
    var out: FragmentOutput;
    out.color = apply_pbr_lighting(pbr_input);
    let reflected = TAP_LUMINANCE * view.exposure * tap_reflected(pbr_input.N, __TANGENT__in.world_tangent.xyz, __END__pbr_input.V);
    out.color = vec4f(out.color.rgb + reflected, out.color.a);
    out.color = main_pass_post_lighting_processing(pbr_input, out.color);
    return out;
}
