// Compact reflection maps in Unity. The text was written by Specula for one light and one material.
#ifndef SPECULA_TAPS
#define SPECULA_TAPS

Texture2D tap_levels;
Texture2D tap_normals;
Texture2D tap_table;
SamplerState tap_sampler_linear_clamp; // Unity takes the filter and the edges from the name
#define tap_sampler tap_sampler_linear_clamp

__FUNCTIONS__
// A Custom Function node of Shader Graph, of type File and with the name TapReflected. N__TANGENT__, T__END__ and V are in the world.
void TapReflected_float(float3 N, __TANGENT__float3 T, __END__float3 V, out float3 Radiance)
{
    Radiance = tap_reflected(normalize(N), __TANGENT__T, __END__normalize(V));
}

#endif
