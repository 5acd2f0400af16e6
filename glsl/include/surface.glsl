// What a sample does with light: by its material's own reflectance, or by the lobes that the filter found. Include after local.glsl,
// materials.glsl and lobes.glsl; the includer declares UNFILTERED.
#ifndef SURFACE_GLSL
#define SURFACE_GLSL

struct Surface {
    Local frame;
    Material material;
    Lobes lobes;
};

bool lobed(Surface s) {
    return LOBED != 0u && (s.lobes.count > 0u || UNFILTERED == 0u);
}

// A direction of light.
struct Drawn {
    vec3 wi;       // local, may be below the horizon; 0 if none is drawn
    vec3 h;        // half vector
    float density; // per steradian of wi; 0 if it is that which lobes_evaluate gives
};

// From two 32-bit numbers.
Drawn surface_sample(Surface s, uvec2 u) {
    Drawn d = Drawn(vec3(0.0), vec3(0.0, 0.0, 1.0), 0.0);
    if (UNFILTERED != 0u) {
        vec4 half_vector = material_sample(s.material, u);
        float cos_d = dot(s.frame.view, half_vector.xyz);
        d.h = half_vector.xyz;
        d.wi = cos_d > 0.0 ? d.h * (2.0 * cos_d) - s.frame.view : d.wi;
        d.density = half_vector.w * 0.25 / max(cos_d, 1e-30);
    }
    if (lobed(s)) {
        d.wi = lobes_sample(s.material, s.lobes, s.frame.view, u);
        d.h = normalize(d.wi + s.frame.view);
        d.density = 0.0;
    }
    return d;
}

#endif
