// What a material reflects, by its reflectance itself, of lights that are points and directions and of an environment's suns. Include
// after lights.glsl, shadows.glsl and approximation.glsl; the includer reads suns and declares `lights`.
#ifndef DIRECT_GLSL
#define DIRECT_GLSL

// Concentration of a lobe, times a sun's squared radius, above which the sun is no point to it: its peak would be higher by a
// quarter of that.
const float SHARP = 0.04;
// So many radii and standard deviations of the lobe away the sun is a point again.
const float FAR = 4.0;

// What light from unit world direction w adds, of irradiance `power` at normal incidence.
vec3 reflected_light(Local f, Material m, Lobes l, vec3 w, vec3 power) {
    vec3 wi = vec3(dot(w, f.x), dot(w, f.y), dot(w, f.z));
    bool above = wi.z > 0.0;
    wi = above ? wi : f.view;
    vec3 h = normalize(wi + f.view), value = vec3(0.0);
    if (UNFILTERED != 0u) {
        value = material_evaluate(m, wi, f.view, h) * wi.z;
    }
    if (LOBED != 0u) {
        vec3 found = lobes_evaluate(m, l, wi, f.view, h).rgb;
        value = l.count > 0u ? found : value;
    }
    return above ? value * power : vec3(0.0);
}

// Of exact lights, at world point `at` of shading sample p.
vec3 reflected_lights(Local f, Material m, Lobes l, vec3 at, ivec2 p) {
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < frame.lights.x; ++i) {
        vec4 w = light_exact(lights[i], at);
        sum += reflected_light(f, m, l, w.xyz, shadowed(lights[i], p) * w.w);
    }
    return sum;
}

// Of all suns; `sharpest` is the largest concentration of the material's lobes.
vec3 reflected_suns(Local f, Material m, Lobes l, Approximation a, float sharpest) {
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < suns_count(); ++i) {
        SunRecord sun = environment_suns.list.all[i];
        vec3 w = suns_direction(sun.place.xy);
        vec3 wi = vec3(dot(w, f.x), dot(w, f.y), dot(w, f.z));
        // Whether its shape is seen: in lobes that are about as narrow, and only so far from them.
        bool seen = false;
        uint lobes = sharpest * sun.place.z > SHARP ? a.count : 0u;
        for (uint k = 0u; k < lobes; ++k) {
            ReflectedLobe lobe = approximation_lobe(m, l, a, k, f.view);
            vec3 d = wi - lobe.direction;
            float reach = FAR * (inversesqrt(lobe.kappa) + sqrt(sun.place.z));
            seen = seen || lobe.kappa * sun.place.z > SHARP && dot(d, d) < reach * reach;
        }
        uint points = seen ? sun.points.y : 1u;
        for (uint k = 0u; k < points; ++k) {
            SunPoint point = environment_suns.list.points[sun.points.x + k];
            w = seen ? suns_direction(point.place.xy) : w;
            sum += reflected_light(f, m, l, w, (seen ? point.irradiance.rgb : sun.irradiance.rgb) * frame.environment.y);
        }
    }
    return sum;
}

#endif
