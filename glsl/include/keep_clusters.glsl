// The lobes of clusters of what a pixel covers: between base texels, which have their lobes as they are, and the levels of moments.
// Part of filter.comp.

// `own` is 1 / kappa of the lobes below: what is wider than that is the spread of their normals.
void keep_ellipse(ivec2 p, inout Found f, Ellipse e, float mass, float own, vec3 normal, uint flags) {
    if (f.count >= LOBES) {
        return;
    }
    float along = e.kappa / e.ratio, across = e.kappa * e.ratio;
    along /= 1.0 + 0.5 * along * f.kernel;
    across /= 1.0 + 0.5 * across * f.kernel;
    float kappa = sqrt(along * across), share = mass * moments_area(kappa, f.lobes) / f.area;
    vec3 mu = f.frame * moments_direction(e.mu), below = f.frame * moments_direction(normal);
    uvec4 lobe = found_pack_along(mu, f.frame * e.axis, sqrt(across / along), 1.0 / max(own * across, 1e-12), below, kappa, share);
    lobe.w |= flags;
    imageStore(lobes, ivec3(p, int(f.count)), lobe);
    f.count += 1u;
    f.sharpest = share > MATTERS ? max(f.sharpest, across) : f.sharpest;
}

void decode_clusters(ivec2 p, MapRecord record, vec2 uv, Reach r, uint lobe_layer, inout Found f) {
    vec4 firsts[MOST_CLUSTERS];
    vec4 seconds[MOST_CLUSTERS]; // with the normal, if lobes are not about it
    for (uint i = 0u; i < MOST_CLUSTERS; ++i) {
        firsts[i] = vec4(0.0);
        seconds[i] = vec4(0.0);
    }
    vec3 thirds[MOST_COLOURED];
    for (uint i = 0u; i < MOST_COLOURED; ++i) {
        thirds[i] = vec3(0.0);
    }
    uint first = record.clusters.x, all = record.clusters.y;
    bool coloured = COLOURED && record.clusters.z != 0u;
    float coarse = min(r.level, 1.0), level = max(r.level - 1.0, 0.0);
    for (float tap = 0.0; tap < r.taps; ++tap) {
        vec2 at = reach_tap(r, uv, tap);
        float share = coarse / r.taps;
        // Layers beyond the material's own are another's.
        for (uint i = 0u; i < CLUSTERS; i += 2u) {
            firsts[i] += fetch(CELL_CLASSES, record.cells, i, at, level) * (i < all ? share : 0.0);
            bool upright = record.upright != 0u;
            vec4 two = fetch(CELL_CLASSES, record.cells, all + (upright ? i / 2u : i), at, level) * (i < all ? share : 0.0);
            seconds[i] += upright ? vec4(two.xy, 0.0, 0.0) : two;
            seconds[i + 1u].xy += upright ? two.zw : vec2(0.0);
            for (uint k = i + 1u; k < (upright ? 0u : min(all, i + 2u)); ++k) {
                seconds[i + 1u] += fetch(CELL_CLASSES, record.cells, all + k, at, level) * share;
            }
            if (i + 1u < CLUSTERS) {
                firsts[i + 1u] += fetch(CELL_CLASSES, record.cells, i + 1u, at, level) * (i + 1u < all ? share : 0.0);
            }
        }
        for (uint i = 0u; i < (coloured ? min(all, MOST_COLOURED) : 0u); ++i) {
            thirds[i] += fetch(CELL_CLASSES, record.cells, clusters_colour(i, all, record.upright), at, level).rgb * share;
        }
        vec2 place = vec2(at.x, 1.0 - at.y) * r.size - 0.5, corner_of = floor(place), part = place - corner_of;
        // Base texels, where they count.
        for (uint k = 0u; k < (coarse < 1.0 ? 4u : 0u); ++k) {
            vec2 corner = vec2(k & 1u, k >> 1), weight = mix(1.0 - part, part, corner);
            vec2 centre = (corner_of + corner + 0.5) / r.size, below = vec2(0.0);
            for (uint j = record.upright; j < 1u; ++j) {
                below = stereographic_of(fetch(MOMENT_CLASSES, record.moments, 0u, vec2(centre.x, 1.0 - centre.y), 0.0).xyz);
            }
            vec3 colour = vec3(0.0);
            if (coloured) {
                colour = fetch(MOMENT_CLASSES, record.moments, lobe_layer + record.count, vec2(centre.x, 1.0 - centre.y), 0.0).rgb;
            }
            for (uint j = 0u; j < record.count; ++j) {
                vec4 lobe = fetch(MOMENT_CLASSES, record.moments, lobe_layer + j, vec2(centre.x, 1.0 - centre.y), 0.0);
                float own = record.weights[j] * weight.x * weight.y * ((1.0 - coarse) / r.taps);
                Placed placed = cluster_place(first, all, lobe.xyz, lobe.w, own, record.lobes);
                for (uint i = 0u; i < MOST_CLUSTERS; ++i) {
                    bool mine = i == placed.cluster;
                    firsts[i] += mine ? placed.first : vec4(0.0);
                    seconds[i] += mine ? vec4(placed.second, below * placed.first.x) : vec4(0.0);
                }
                for (uint i = 0u; i < (coloured ? MOST_COLOURED : 0u); ++i) {
                    thirds[i] += i == placed.cluster ? colour * placed.first.x : vec3(0.0);
                }
            }
        }
    }
    vec3 normal = record.upright != 0u ? vec3(0.0) : look_up(MOMENT_CLASSES, record.moments, 0u, uv, r).xyz;
    vec3 sum = vec3(0.0);
    float mass = 0.0;
    f.area = record.facing;
    // Over their own mean: what the map of colours has beyond the moments' size stays.
    vec3 mean = vec3(0.0);
    float all_mass = 0.0;
    for (uint i = 0u; i < (coloured ? min(all, MOST_COLOURED) : 0u); ++i) {
        mean += firsts[i].x > LEAST_WEIGHT ? thirds[i] : vec3(0.0);
        all_mass += firsts[i].x > LEAST_WEIGHT ? firsts[i].x : 0.0;
    }
    mean /= max(all_mass, LEAST_WEIGHT);
    uvec4 colours = uvec4(0u);
    for (uint i = 0u; i < CLUSTERS; ++i) {
        float q = i < all ? firsts[i].x : 0.0;
        if (q > LEAST_WEIGHT) {
            Cluster c = clusters[first + i];
            Ellipse e = cluster_decode(c, firsts[i], seconds[i].xy);
            if (coloured && i < MOST_COLOURED) {
                vec3 colour = thirds[min(i, MOST_COLOURED - 1u)] / q;
                colours[min(f.count, 3u)] = found_pack_colour(mix(vec3(1.0), colour / max(mean, 1e-9), greaterThan(mean, vec3(1e-9))));
            }
            vec3 below = record.upright != 0u ? e.mu : stereographic_direction(seconds[i].zw / q);
            keep_ellipse(p, f, e, q, c.own.x, below, coloured ? FOUND_COLOURED : 0u);
            sum += e.mu * q;
            mass += q;
        }
    }
    if (coloured) {
        imageStore(lobes, ivec3(p, int(LOBES) - 1), colours);
    }
    f.mean = record.upright != 0u ? sum / max(mass, LEAST_WEIGHT) : normal;
}
