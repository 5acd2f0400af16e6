// Reflection by the lobes that the filter found at a sample (src/distribution/surface.rs is the f64 twin). Each is a facet: a surface
// of its own, with the normal of what is below it, which is the lobe's direction for materials whose lobes are about the normal.
// Gaussians of slopes are one distribution about the surface's own normal. Include after materials.glsl and local.glsl; the includer
// defines LOBES_BINDING.
#ifndef LOBES_GLSL
#define LOBES_GLSL
#include "found.glsl"
#include "sobol.glsl"

// Layers of `lobes_found`, of which one is bound in any case, and whether they hold lobes.
layout(constant_id = 6) const uint LAYERS = 1u;
layout(constant_id = 7) const uint LOBED = 0u;
// Whether lobes are Gaussians of slopes, and how these are masked: as V-cavities or by Smith's factor.
layout(constant_id = 8) const uint SLOPES = 0u;
layout(constant_id = 9) const uint SMITH = 0u;
// Whether lobes of directions are elliptic, and, if it is 2, some of colours of their own.
layout(constant_id = 11) const uint ELLIPTIC = 0u;
const bool COLOURED = ELLIPTIC == 2u;

// As found.glsl packs them, all 0 after the last. Slopes, two layers each: mean, weight; covariance xx, xy, yy.
layout(set = 2, binding = LOBES_BINDING) uniform usampler2DArray lobes_found;

// Directions: local mean direction; cosine of the normal to the viewer, at least FACING.
// Slopes, two entries each, in the tangent frame: mean, the density's height, weight.
vec4 lobe_axis[LAYERS];
// Directions: alpha squared (GGX), exponent (cosine powers) or concentration; D at the centre (of GGX times alpha^4); weight; density
// there of what is drawn.
// Slopes: inverse of the covariance; the covariance.
vec4 lobe_shape[LAYERS];
// Directions: local normal.
vec3 lobe_normal[LAYERS];
// Elliptic: the axis and the direction across, divided by the width there over that of a round lobe.
vec3 lobe_along[LAYERS];
vec3 lobe_across[LAYERS];
// How far normals follow the half vector: factors on its parts along both, and along the axis, of 1.
vec3 lobe_follow[LAYERS];
// What turns the lobe's direction to the normal: the axis times the sine, the cosine.
vec4 lobe_turn[LAYERS];

// Coloured: the specular colour.
vec3 lobe_colour[LAYERS];

// The sample's lobes, with those.
struct Lobes {
    uint count;
    float diffuse; // share of directions that are drawn by the cosine
};

float mean_of(vec3 c) {
    return dot(c, vec3(1.0 / 3.0));
}

// The sum of the weights of a material's own lobes.
float lobes_total(Material m) {
    bool vmf = m.record.kind.x == REFLECTANCE_VMF;
    float total = vmf ? 0.0 : 1.0;
    for (uint i = 0u; i < (vmf ? m.record.kind.z : 0u); ++i) {
        total += materials[m.record.kind.y + i].albedo.y;
    }
    return total;
}

Lobes lobes_load(ivec2 p, Local f, Material m) {
    Lobes l;
    l.count = 0u;
    l.diffuse = 0.0;
    if (LOBED == 0u) {
        return l;
    }
    float total = lobes_total(m);
    uint kind = m.record.kind.x;
    bool ggx = kind == REFLECTANCE_GGX, cosine = kind == REFLECTANCE_BLINN_PHONG;
    if (SLOPES != 0u) {
        for (uint i = 0u; 2u * i + 1u < LAYERS; ++i) {
            vec4 first = uintBitsToFloat(texelFetch(lobes_found, ivec3(p, int(2u * i)), 0));
            if (first.z <= 0.0) {
                break;
            }
            vec4 second = uintBitsToFloat(texelFetch(lobes_found, ivec3(p, int(2u * i) + 1), 0));
            float determinant = second.x * second.z - second.y * second.y;
            lobe_axis[2u * i] = vec4(first.xy, 0.5 * INV_PI * inversesqrt(determinant), first.z * total);
            lobe_shape[2u * i] = vec4(vec3(second.z, -second.y, second.x) / determinant, 0.0);
            lobe_shape[2u * i + 1u] = second;
            l.count += 1u;
        }
    } else {
        uvec4 colours = uvec4(0u);
        if (COLOURED) {
            colours = texelFetch(lobes_found, ivec3(p, int(LAYERS) - 1), 0);
        }
        for (uint i = 0u; i < LAYERS; ++i) {
            uvec4 found = texelFetch(lobes_found, ivec3(p, int(i)), 0);
            if (found_none(found)) {
                break;
            }
            vec3 centre = ELLIPTIC != 0u ? found_direction_along(found) : found_direction(found);
            vec3 below = ELLIPTIC != 0u ? found_normal_along(found) : found_normal(found);
            vec3 mu = centre * mat3(f.x, f.y, f.z), normal = below * mat3(f.x, f.y, f.z);
            float kappa = found_concentration(found), spread = vmf_spread(kappa), height = vmf_normalisation(kappa);
            float a = ggx ? clamp(2.0 / kappa, 1e-6, 1.0) : (cosine ? max(1.0 / spread - 2.0, 0.0) : kappa);
            float peak = ggx ? a * INV_PI : (cosine ? blinn_phong_peak(a) : height / max(1.0 - spread, LEAST_PROJECTED_AREA));
            lobe_axis[i] = vec4(mu, max(dot(normal, f.view), FACING));
            lobe_shape[i] = vec4(a, peak, found_weight(found) * total, height);
            lobe_normal[i] = normal;
            if (COLOURED) {
                bool own = (found.w & FOUND_COLOURED) != 0u;
                vec3 colour = m.record.f0.rgb * (own ? found_colour(colours[min(i, 3u)]) : vec3(1.0));
                lobe_colour[i] = ggx || cosine ? min(colour, 1.0) : colour;
            }
            if (ELLIPTIC != 0u) {
                vec3 x, y;
                tangent_basis(centre, x, y);
                vec2 axis = found_axis(found);
                float stretch = found_stretch(found);
                vec3 along = (x * axis.x + y * axis.y) * mat3(f.x, f.y, f.z);
                lobe_along[i] = along / stretch;
                lobe_across[i] = cross(mu, along) * stretch;
                float ratio = stretch * stretch, across = 1.0 / found_narrower(found), follow = 1.0 - across / (ratio * ratio);
                lobe_follow[i] = vec3(follow * ratio, (1.0 - across) / ratio, follow);
                lobe_turn[i] = vec4(cross(mu, normal), dot(mu, normal));
            }
            l.count += 1u;
        }
    }
    float base = mean_of(m.record.albedo.rgb), gloss = mean_of(m.record.f0.rgb) * total;
    l.diffuse = base > 0.0 ? base / (base + gloss) : 0.0;
    return l;
}

// Local directions in the tangent frame, and back.
vec3 to_tangent(Material m, vec3 v) {
    return vec3(m.turn.x * v.x - m.turn.y * v.y, (m.turn.y * v.x + m.turn.x * v.y) * m.turn.z, v.z);
}

vec3 from_tangent(Material m, vec3 v) {
    v.y *= m.turn.z;
    return vec3(m.turn.x * v.x + m.turn.y * v.y, m.turn.x * v.y - m.turn.y * v.x, v.z);
}

// The area of the mean surface of slopes seen from unit w, over the surface's own.
float slope_facing(vec2 mean, vec3 w) {
    return w.z - dot(mean, w.xy);
}

// Smith's Lambda about the mean slope (src/distribution/slope.rs); large where the mean surface faces away.
float slope_lambda(vec2 mean, vec3 covariance, vec3 w) {
    float sine = length(w.xy);
    vec2 along = w.xy / max(sine, 1e-12);
    float variance = covariance.x * along.x * along.x + 2.0 * covariance.y * along.x * along.y + covariance.z * along.y * along.y;
    float x = (w.z - sine * dot(mean, along)) / max(sine * sqrt(variance), 1e-12);
    // The standard normal density, and the probability above x (Abramowitz and Stegun 26.2.17).
    float gaussian = exp(-0.5 * min(x * x, 80.0)) * 0.3989422804;
    float t = 1.0 / (1.0 + 0.2316419 * max(x, 0.0));
    float tail = gaussian * t * (0.31938153 + t * (-0.356563782 + t * (1.781477937 + t * (-1.821255978 + t * 1.330274429))));
    return x <= 0.0 ? 1e30 : max(gaussian / x - tail, 0.0);
}

// The material's reflectance times the cosine in rgb, for light from wi above the horizon, h the half vector; in a the density per
// steradian with which lobes_sample draws wi.
vec4 lobes_evaluate(Material m, Lobes l, vec3 wi, vec3 wo, vec3 h) {
    uint kind = m.record.kind.x;
    bool ggx = kind == REFLECTANCE_GGX, cosine = kind == REFLECTANCE_BLINN_PHONG;
    float across = dot(wo, h);
    float c = clamp(1.0 - across, 0.0, 1.0), c2 = c * c, grazing = c2 * c2 * c;
    vec3 coloured = vec3(0.0);
    float specular = 0.0, diffuse = 0.0, density = 0.0, weights = 0.0;
    if (SLOPES != 0u) {
        vec3 t = to_tangent(m, h), ti = to_tangent(m, wi), to = to_tangent(m, wo);
        bool up = t.z > 0.0;
        float inverse = 1.0 / max(t.z, 1e-4), cube = up ? inverse * inverse * inverse : 0.0;
        vec2 slope = -t.xy * inverse;
        float cavity = cavity_masking(wi, wo, h);
        for (uint i = 0u; i < l.count; ++i) {
            vec4 axis = lobe_axis[2u * i], shape = lobe_shape[2u * i];
            vec2 d = slope - axis.xy;
            float square = shape.x * d.x * d.x + 2.0 * shape.y * d.x * d.y + shape.z * d.y * d.y;
            float drawn = axis.w * axis.z * exp(-0.5 * square) * cube;
            float open = cavity;
            if (SMITH != 0u) {
                vec3 covariance = lobe_shape[2u * i + 1u].xyz;
                float fi = slope_facing(axis.xy, ti), fo = slope_facing(axis.xy, to);
                float lambdas = slope_lambda(axis.xy, covariance, ti) + slope_lambda(axis.xy, covariance, to);
                open = fi > 0.0 && fo > 0.0 ? 0.25 / ((1.0 + lambdas) * fi * fo) : 0.0;
            }
            specular += drawn * inverse * open * wi.z;
            diffuse += axis.w * max(dot(normalize(vec3(-axis.xy, 1.0)), ti), 0.0);
            density += drawn;
            weights += axis.w;
        }
    } else {
        for (uint i = 0u; i < l.count; ++i) {
            vec4 axis = lobe_axis[i], shape = lobe_shape[i];
            vec3 d = h - axis.xyz;
            float square = dot(d, d), ch = 1.0 - 0.5 * square, sine = square * (1.0 - 0.25 * square);
            vec3 normal = lobe_normal[i];
            float mean = max(dot(normal, wi), 0.0), co = axis.w;
            float stretched = sine, factor = 1.0, power = shape.x, whole = 1.0;
            if (ELLIPTIC != 0u) {
                float along = dot(d, lobe_along[i]), over = dot(d, lobe_across[i]);
                // The normal of the places whose lobes are at the half vector, turned as the mean one is from the lobe's direction.
                vec3 follow = lobe_follow[i], at = axis.xyz * (1.0 - follow.z * (0.5 * square));
                at = normalize(at + lobe_along[i] * (along * follow.x) + lobe_across[i] * (over * follow.y));
                vec4 turn = lobe_turn[i];
                normal = at * turn.w + cross(turn.xyz, at) + turn.xyz * (dot(turn.xyz, at) / max(1.0 + turn.w, 1e-3));
                co = max(dot(normal, wo), FACING);
                // Towards the half vector the concentration is `factor` times as large.
                stretched = along * along + over * over;
                factor = sine > 0.0 ? stretched / sine : 1.0;
                power = max(factor * (shape.x + 2.0) - 2.0, 0.0);
                whole = (1.0 - exp(-2.0 * shape.x)) / max(1.0 - exp(-2.0 * shape.x * factor), 1e-30);
                whole = ggx || cosine || shape.x < 1e-3 ? 1.0 : whole;
            }
            float ci = dot(normal, wi);
            bool lit = ci > 0.0;
            ci = lit ? ci : 1.0;
            float q = shape.x * ch * ch + stretched;
            float exponent = cosine ? 0.5 * power * log_complement(min(sine, 1.0)) : -0.5 * shape.x * factor * square;
            float normals = shape.y * whole * (ggx ? 1.0 / (q * q) : exp(exponent));
            normals = (ggx || cosine) && ch <= 0.0 ? 0.0 : normals;
            float open = ggx ? 1.0 / (ggx_masking(ci, shape.x) * ggx_masking(co, shape.x))
                             : min(0.25 / (ci * co), 0.5 * max(dot(normal, h), 0.0) / (across * max(ci, co)));
            float lit_weight = lit ? shape.z * ci : 0.0;
            specular += normals * open * lit_weight;
            if (COLOURED) {
                vec3 own = lobe_colour[i];
                coloured += (ggx ? own + (1.0 - own) * grazing : own) * (normals * open * lit_weight);
            }
            diffuse += shape.z * mean;
            density += shape.z * (ggx || cosine ? normals * ch : shape.w * whole * exp(exponent));
            weights += shape.z;
        }
    }
    density *= 0.25 / (across * weights);
    density = mix(density, max(wi.z, 0.0) * INV_PI, l.diffuse);
    vec3 f = m.record.f0.rgb;
    vec3 below = m.record.albedo.rgb;
    if (ggx) {
        f += (1.0 - f) * grazing;
        below *= 1.0 - f;
    }
    // The weights of a reflectance of lobes are its colour's, not its base's.
    return vec4((COLOURED ? coloured : f * specular) + below * (INV_PI * diffuse / weights), density);
}

// A direction of lobe i: of GGX's or a cosine power's density of normals times the cosine, or of the lobe itself.
vec3 lobes_half(bool ggx, bool cosine, uint i, vec2 u) {
    vec3 mu = lobe_axis[i].xyz, x, y;
    float a = lobe_shape[i].x, t; // 1 - cosine
    vec2 turn = cos_sin((2.0 * u.y - 1.0) * PI);
    if (ELLIPTIC != 0u) {
        // Widths over a round lobe's; where it is wider by some factor, the concentration is smaller by its square.
        float across = length(lobe_across[i]);
        x = lobe_along[i] * across;
        y = lobe_across[i] / across;
        turn *= vec2(across, 1.0 / across);
        float square = dot(turn, turn);
        turn *= inversesqrt(square);
        a = ggx ? a * square : (cosine ? max((a + 2.0) / square - 2.0, 0.0) : a / square);
    } else {
        tangent_basis(mu, x, y);
    }
    if (ggx) {
        float square = a * u.x / max(1.0 - u.x, 1e-7); // of the tangent
        t = square / (1.0 + square + sqrt(1.0 + square));
    } else if (cosine) {
        t = 1.0 - pow(max(1.0 - u.x, 1e-7), 1.0 / (a + 2.0));
    } else {
        t = a < 1e-4 ? 2.0 * u.x : min(-log(max(1.0 - u.x * (1.0 - exp(-2.0 * a)), 1e-30)) / a, 2.0);
    }
    turn *= sqrt(max(t * (2.0 - t), 0.0));
    return x * turn.x + y * turn.y + mu * (1.0 - t);
}

// A direction of light from two 32-bit numbers, of which the first also chooses the lobe. It may lie below the horizon; 0 if none is.
vec3 lobes_sample(Material m, Lobes l, vec3 wo, uvec2 number) {
    vec2 u = vec2(to_unit(number.x), to_unit(number.y));
    if (u.x < l.diffuse) {
        float square = u.x / l.diffuse;
        return vec3(sqrt(square) * cos_sin((2.0 * u.y - 1.0) * PI), sqrt(1.0 - square));
    }
    u.x = (u.x - l.diffuse) / (1.0 - l.diffuse);
    float total = 0.0;
    for (uint i = 0u; i < l.count; ++i) {
        total += SLOPES != 0u ? lobe_axis[2u * i].w : lobe_shape[i].z;
    }
    float left = u.x * total, share = 0.0;
    uint chosen = 0u;
    bool found = false;
    for (uint i = 0u; i < l.count; ++i) {
        float weight = SLOPES != 0u ? lobe_axis[2u * i].w : lobe_shape[i].z;
        bool here = !found && (left < weight || i + 1u == l.count);
        chosen = here ? i : chosen;
        share = here ? left / weight : share;
        found = found || here;
        left -= weight;
    }
    u.x = clamp(share, 0.0, 0.99999994);
    vec3 h;
    if (SLOPES != 0u) {
        vec4 axis = lobe_axis[2u * chosen];
        vec3 covariance = lobe_shape[2u * chosen + 1u].xyz;
        vec2 normal = sqrt(-2.0 * log(max(1.0 - u.x, 1e-7))) * cos_sin((2.0 * u.y - 1.0) * PI);
        float x = sqrt(covariance.x), rest = sqrt(max(covariance.z - covariance.y * covariance.y / covariance.x, 0.0));
        vec2 slope = axis.xy + vec2(x * normal.x, covariance.y / x * normal.x + rest * normal.y);
        h = from_tangent(m, normalize(vec3(-slope, 1.0)));
    } else {
        uint kind = m.record.kind.x;
        h = lobes_half(kind == REFLECTANCE_GGX, kind == REFLECTANCE_BLINN_PHONG, chosen, u);
    }
    float across = dot(wo, h);
    return across > 0.0 ? h * (2.0 * across) - wo : vec3(0.0);
}

#endif
