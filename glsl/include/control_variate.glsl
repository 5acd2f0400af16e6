// The lobes that stand for a material as look-ups of pre-convolved light hold them: what is estimated beside a look-up is what these
// leave of the reflectance. Include after approximation.glsl; the includer reads suns and enables
// GL_EXT_control_flow_attributes.
#ifndef CONTROL_VARIATE_GLSL
#define CONTROL_VARIATE_GLSL
#include "texel_kernel.glsl"

// The most lobes that stand for a material.
layout(constant_id = 14) const uint APPROXIMATING = 1u;
// Whether lobes are taken to be just what look-ups of them hold.
layout(constant_id = 16) const uint EXACT = 0u;

// The lobes that stand for the material as they are looked up, which is between two levels (glsl/include/prefilter.glsl): direction;
// exponent of a squared distance in the broader level, height there, height in the sharper one, whether that is the map;
// factor on irradiance.
vec3 approximating_direction[APPROXIMATING];
float approximating_scale[APPROXIMATING];
vec3 approximating_broad[APPROXIMATING];
vec3 approximating_sharp[APPROXIMATING];
bool approximating_map[APPROXIMATING];
bool approximating_even[APPROXIMATING]; // the sharper level is one of the second image
vec3 approximating_diffuse;
float approximating_sharpest; // the largest concentration

void approximate(Material m, Lobes l, Approximation a, vec3 wo) {
    approximating_diffuse = a.diffuse;
    approximating_sharpest = 0.0;
    [[unroll]] for (uint i = 0u; i < APPROXIMATING; ++i) {
        bool there = i < a.count;
        ReflectedLobe lobe = approximation_lobe(m, l, a, there ? i : 0u, wo);
        approximating_direction[i] = lobe.direction;
        approximating_sharpest = max(approximating_sharpest, there ? lobe.kappa : 0.0);
        // As `prefiltered` has it; the map's bilinear look-ups are 4 factors of 2 sharper than the sharpest lobe.
        vec4 scale = environment_suns.list.scale;
        float steps = min(-log2(lobe.kappa * scale.x), scale.y);
        steps = EXACT != 0u ? max(steps, 0.0) : steps;
        bool map = steps < 0.0;
        float whole = floor(steps);
        float kappa = exp2(map ? 0.0 : -whole - 1.0) / scale.x, sharper = kappa * (map ? 16.0 : 2.0);
        float weight = map ? 1.0 - min(-steps * scale.z, 1.0) : steps - whole;
        vec3 amplitude = there ? lobe.weight : vec3(0.0);
        approximating_scale[i] = -0.5 * kappa;
        approximating_broad[i] = amplitude * (weight * vmf_normalisation(kappa));
        approximating_sharp[i] = amplitude * ((1.0 - weight) * vmf_normalisation(sharper));
        approximating_map[i] = map;
        approximating_even[i] = fract(0.5 * whole) == 0.0;
    }
}

// What they have in the place of reflectance times cosine, for light from local wi, which may be below the horizon.
vec3 approximation(Local f, vec3 wi) {
    vec3 sum = approximating_diffuse * max(wi.z, 0.0);
    [[unroll]] for (uint i = 0u; i < APPROXIMATING; ++i) {
        vec3 d = wi - approximating_direction[i];
        float broad = exp(approximating_scale[i] * dot(d, d)), sharp = broad * broad;
        float fourth = sharp * sharp, eighth = fourth * fourth;
        sharp = approximating_map[i] ? eighth * eighth : sharp;
        if (EXACT != 0u) {
            vec3 centre = to_world(f, approximating_direction[i]), w = to_world(f, wi);
            float kappa = -2.0 * approximating_scale[i];
            bool even = approximating_even[i];
            broad = texel_kernel(centre, kappa, even ? 2.0 : 4.0, w) / vmf_normalisation(kappa);
            sharp = texel_kernel(centre, 2.0 * kappa, even ? 4.0 : 2.0, w) / vmf_normalisation(2.0 * kappa);
        }
        sum += approximating_broad[i] * broad + approximating_sharp[i] * sharp;
    }
    return sum;
}

#endif
