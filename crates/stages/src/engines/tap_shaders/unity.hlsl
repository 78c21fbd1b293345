// Compact reflection maps in Unity. The text was written by Specula for one light and one material.
#ifndef SPECULA_TAPS
#define SPECULA_TAPS

Texture2D tap_levels;
Texture2D tap_normals;
Texture2D tap_table;
SamplerState tap_sampler_linear_clamp; // Unity takes the filter and the edges from the name
#define tap_sampler tap_sampler_linear_clamp

__FUNCTIONS__
// A Custom Function node of Shader Graph, of type File and with the name TapReflected. N and V are in the world.
void TapReflected_float(float3 N, float3 V, out float3 Radiance)
{
    Radiance = tap_reflected(normalize(N), normalize(V));
}

#endif
