// What pre-convolved light is looked up with: a material seen from one direction as lobes of light directions, and its diffuse
// part. src/distribution/reflected.rs is the f64 twin. Include after materials.glsl,
// and after lobes.glsl where the filter leaves lobes.
#ifndef REFLECTED_GLSL
#define REFLECTED_GLSL
#include "vmf.glsl"

struct ReflectedLobe {
    vec3 direction; // centre, in the local frame, unit
    float kappa;
    vec3 weight;    // factor on the light under the lobe, cosine included; 0 where its centre is not seen or below the horizon
};

uint reflected_count(Material m) {
    return m.record.kind.x == REFLECTANCE_VMF ? m.record.kind.z : 1u;
}

// Lobe i seen from wo. Kinds share the look-up, so that there is one for all.
ReflectedLobe reflected_lobe(Material m, uint i, vec3 wo) {
    uint kind = m.record.kind.x;
    vec3 centre = vec3(0.0, 0.0, 1.0);
    float kappa, peak; // of half vectors
    if (kind == REFLECTANCE_GGX) {
        kappa = 2.0 / (m.record.f0.a * m.record.f0.a);
        peak = kappa * (0.5 * INV_PI);
    } else if (kind == REFLECTANCE_BLINN_PHONG) {
        kappa = m.record.f0.a + 2.0;
        peak = m.peaks.x;
    } else {
        // Tables have none, and read what is there for nothing.
        uint record = kind == REFLECTANCE_VMF ? m.record.kind.y + min(i, m.record.kind.z - 1u) : 0u;
        vec3 mu = materials[record].f0.xyz;
        vec2 lobe = material_lobe(m, record);
        kappa = lobe.x;
        peak = lobe.y;
        // The tangent frame's own handedness first, then the turn back.
        mu.y *= m.turn.z;
        centre = vec3(m.turn.x * mu.x + m.turn.y * mu.y, m.turn.x * mu.y - m.turn.y * mu.x, mu.z);
    }
    float cosine = dot(wo, centre);
    ReflectedLobe lobe;
    lobe.direction = centre * (2.0 * cosine) - wo;
    bool seen = cosine > 0.0 && lobe.direction.z > 0.0;
    cosine = seen ? cosine : 1.0;
    vec3 wi = seen ? lobe.direction : wo;
    lobe.kappa = kappa / (4.0 * cosine);
    vec3 value;
    if (kind == REFLECTANCE_GGX) {
        float c = clamp(1.0 - cosine, 0.0, 1.0), c2 = c * c;
        float a2 = m.record.f0.a * m.record.f0.a;
        value = (m.record.f0.rgb + (1.0 - m.record.f0.rgb) * (c2 * c2 * c)) / (ggx_masking(wi.z, a2) * ggx_masking(wo.z, a2));
    } else {
        value = m.record.f0.rgb * cavity_masking(wi, wo, centre);
    }
    lobe.weight = seen ? value * (wi.z * peak / vmf_normalisation(lobe.kappa)) : vec3(0.0);
    return lobe;
}

#ifdef LOBES_GLSL
// Lobe i of those that the filter found, seen from wo. A Gaussian of slopes counts as the lobe about its mean slope with the mean
// of its variances.
ReflectedLobe reflected_found(Material m, Lobes l, uint i, vec3 wo) {
    uint kind = m.record.kind.x;
    bool ggx = kind == REFLECTANCE_GGX, cosine = kind == REFLECTANCE_BLINN_PHONG;
    vec3 centre;
    float kappa, peak, weight; // of half vectors
    if (SLOPES != 0u) {
        vec4 axis = lobe_axis[2u * i];
        vec3 covariance = lobe_shape[2u * i + 1u].xyz;
        float square = 1.0 + dot(axis.xy, axis.xy); // 1 / cos^2
        centre = from_tangent(m, vec3(-axis.xy, 1.0) * inversesqrt(square));
        kappa = square * (1.0 + square) / (covariance.x + covariance.z);
        peak = axis.z * square * square;
        weight = axis.w;
    } else {
        centre = lobe_axis[i].xyz;
        float a = lobe_shape[i].x;
        kappa = ggx ? 2.0 / a : (cosine ? a + 2.0 : a);
        // Of GGX lobes.glsl keeps this times alpha^4.
        peak = ggx ? kappa * (0.5 * INV_PI) : lobe_shape[i].y;
        weight = lobe_shape[i].z;
    }
    float cosine_to = dot(wo, centre);
    ReflectedLobe lobe;
    lobe.direction = centre * (2.0 * cosine_to) - wo;
    bool seen = cosine_to > 0.0 && lobe.direction.z > 0.0;
    cosine_to = seen ? cosine_to : 1.0;
    vec3 wi = seen ? lobe.direction : wo;
    lobe.kappa = kappa / (4.0 * cosine_to);
    float ci = wi.z, open = cavity_masking(wi, wo, centre);
    if (SLOPES == 0u) {
        ci = max(dot(lobe_normal[i], wi), 0.0);
        float lit = max(ci, FACING), co = lobe_axis[i].w;
        open = min(0.25 / (lit * co), 0.5 * max(dot(lobe_normal[i], centre), 0.0) / (cosine_to * max(lit, co)));
    }
    if (ggx && SLOPES == 0u) {
        open = 1.0 / (ggx_masking(ci, lobe_shape[i].x) * ggx_masking(lobe_axis[i].w, lobe_shape[i].x));
    }
    vec3 f = m.record.f0.rgb;
    if (COLOURED) {
        f = lobe_colour[i];
    }
    if (ggx) {
        float c = clamp(1.0 - cosine_to, 0.0, 1.0), c2 = c * c;
        f += (1.0 - f) * (c2 * c2 * c);
    }
    lobe.weight = seen ? f * (open * ci * peak * weight / vmf_normalisation(lobe.kappa)) : vec3(0.0);
    return lobe;
}
#endif

// Factor on irradiance in 1/sr.
vec3 reflected_diffuse(Material m, vec3 wo) {
    vec3 base = m.record.albedo.rgb * INV_PI;
    if (m.record.kind.x == REFLECTANCE_GGX) {
        // Fresnel towards the mean direction of diffuse light, the normal.
        float c = 1.0 - sqrt(0.5 + 0.5 * wo.z), c2 = c * c;
        base *= 1.0 - (m.record.f0.rgb + (1.0 - m.record.f0.rgb) * (c2 * c2 * c));
    }
    return base;
}

#endif
