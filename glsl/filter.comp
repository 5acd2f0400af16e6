#version 460
// What a surface is at the pixel's scale: the shading normal, factors on the reflectance's colours, its roughness and what the
// surface's own curvature adds to it. Filter `point`: colours through their mips by the footprint, normals and roughness from
// the base level; `tk` adds the kernel of the interpolated normals' derivatives; the others read both as moments, through mips
// too, and leave lobes. src/material.rs and src/moments.rs are the f64 twins.
#include "frame.glsl"
#include "gbuffer.glsl"
#include "tangent.glsl"
#include "factors.glsl"
#include "moments.glsl"
#include "found.glsl"
#include "roughness.glsl"
#include "look_up.glsl"
#include "geometric.glsl"
#include "sobol.glsl"
#define CLUSTERS_BINDING 14
#include "clusters.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Classes in which there are maps of a kind, one bit each: others are compiled away.
layout(constant_id = 0) const uint ALBEDO_CLASSES = 0u;
layout(constant_id = 1) const uint SPECULAR_CLASSES = 0u;
layout(constant_id = 2) const uint NORMAL_CLASSES = 0u;
layout(constant_id = 3) const uint ROUGHNESS_CLASSES = 0u;
// Whether the mesh's curvature within the pixel widens lobes.
layout(constant_id = 4) const bool GEOMETRIC = false;
// Classes of moments and of their cells, and what of a texel's makes its lobes: FILTER_* of moments.glsl.
layout(constant_id = 5) const uint MOMENT_CLASSES = 0u;
layout(constant_id = 6) const uint CELL_CLASSES = 0u;
layout(constant_id = 7) const uint FILTER = 0u;
// Layers of `lobes`; 0 where the filter has no lobes of its own.
layout(constant_id = 8) const uint LOBES = 0u;
// Whether concentrations follow from lengths by the paper's equation 8, and the lengths below which cells are divided; 0 to go by
// their spread.
layout(constant_id = 11) const bool LITERAL = false;
layout(constant_id = 12) const float LENGTH_OF_ONE = 0.0;
layout(constant_id = 13) const float LENGTH_OF_QUARTERS = 0.0;
// Whether cells are in camera space, each object's own.
layout(constant_id = 14) const bool CAMERA = false;
// The most clusters that a material has.
layout(constant_id = 15) const uint CLUSTERS = 1u;
// Whether those of some keep colours.
layout(constant_id = 16) const bool COLOURED = false;

struct MapRecord {
    uvec4 places;        // albedo, specular, normal, roughness: 0 for none, else (layer << 3 | class) + 1
    vec2 tiling;         // factors on uv
    vec2 rule;           // of the roughness map; the greatest alpha that it gives
    float without;       // albedo factor without an albedo map
    uint moments;        // as `places`, the first layer
    uint cells;
    uint lobes;          // LOBES_* of moments.glsl
    vec4 weights;        // of the lobes
    uint count;          // of them; 0 for those that stay as they are
    uint upright;        // whether all are about the normal
    float concentration; // of the one lobe of a material without maps of normals and roughness
    float facing;        // mean cosine of the lobes' directions to the normal
    uvec4 clusters;      // the first, how many there are, and whether they keep colours; of Gaussians what gaussians.glsl says
};
layout(set = 2, binding = 1, std430) readonly buffer Maps {
    MapRecord maps[]; // by material
};
layout(set = 2, binding = 10, rgba32f) uniform writeonly image2D normals;   // shading normal; tangent as tangent.glsl encodes it
layout(set = 2, binding = 11, rgba32ui) uniform writeonly uimage2D factors; // as factors.glsl packs them
layout(set = 2, binding = 12, rgba32ui) uniform writeonly uimage2DArray lobes; // as found.glsl packs them
layout(set = 2, binding = 13, std430) readonly buffer Objects {
    uint objects[]; // in camera space, by object: its cells, as `MapRecord::cells`
};

// A sample's lobes as they are found.
struct Found {
    mat3 frame;      // world from the frame of what is found: the tangent frame, or the camera's for its cells
    float kernel;    // what widens them
    uint count;
    float sharpest;  // concentration of those that matter
    vec3 mean;       // of their directions, stored as x, y, 1 - z
    uint lobes;      // LOBES_* of moments.glsl
    float area;      // mean cosine of the lobes below, about the normals that they have there
};
const float MATTERS = 0.02;

// Each place below has its own normal, about which its lobes fill the projected area. A wider lobe has less of a mean cosine, and
// so much less weight: the integral over directions stays what it is there.
void keep(ivec2 p, inout Found f, vec3 mu, float kappa, float weight, vec3 normal) {
    if (weight <= LEAST_WEIGHT || f.count >= LOBES) {
        return;
    }
    kappa /= 1.0 + 0.5 * kappa * f.kernel;
    vec3 world = f.frame * moments_direction(mu);
    float share = weight * moments_area(kappa, f.lobes) / f.area;
    vec3 below = f.frame * moments_direction(normal), x, y;
    tangent_basis(world, x, y);
    uvec4 lobe = filter_elliptic(FILTER) ? found_pack_along(world, x, 1.0, 1.0, below, kappa, share) : found_pack(world, below, kappa, share);
    imageStore(lobes, ivec3(p, int(f.count)), lobe);
    f.count += 1u;
    f.sharpest = weight > MATTERS ? max(f.sharpest, kappa) : f.sharpest;
}

// A Gaussian of slopes: in two layers, in the tangent frame.
void keep_slopes(ivec2 p, inout Found f, vec4 first, float product, float weight) {
    if (f.count + 1u >= LOBES) {
        return;
    }
    vec2 variance = max(first.zw - first.xy * first.xy, vec2(LEAST_SLOPE_VARIANCE));
    float most = 0.9999 * sqrt(variance.x * variance.y);
    float covariance = clamp(product - first.x * first.y, -most, most);
    float widened = 0.5 * f.kernel;
    imageStore(lobes, ivec3(p, int(f.count)), floatBitsToUint(vec4(first.xy, weight, 0.0)));
    vec4 matrix = vec4(variance.x + widened, covariance, variance.y + widened, 0.0);
    imageStore(lobes, ivec3(p, int(f.count) + 1), floatBitsToUint(matrix));
    f.count += 2u;
    f.sharpest = max(f.sharpest, 1.0 / min(variance.x, variance.y));
}

// Weight times characteristic vector, weight; weight times the spread of what is in it; weight times the normals below.
struct Cell {
    vec4 sum;
    float spread;
    vec3 normal;
};

float cell_spread(Cell c) {
    return max(moments_spread(c.sum.xyz / max(c.sum.w, LEAST_WEIGHT), 0.0), VMF_LEAST_SPREAD);
}

void keep_cell(ivec2 p, inout Found f, Cell c, float share) {
    if (c.sum.w * share > LEAST_WEIGHT) {
        float spread = cell_spread(c), kappa = LITERAL ? vmf_literal_concentration(spread) : vmf_concentration(spread);
        keep(p, f, c.sum.xyz / c.sum.w, kappa, c.sum.w * share, c.normal / c.sum.w);
    }
}

// How much of a cell's one lobe stays beside those of its parts: by the length of its mean vector, or by how far its spread goes
// beyond that of its lobes.
float cell_kept(Cell c, float length) {
    if (length > 0.0) {
        return 1.0 - cell_spread(c) >= length ? 1.0 : 0.0;
    }
    float base = max(c.spread / max(c.sum.w, LEAST_WEIGHT), VMF_LEAST_SPREAD);
    float t = clamp((1.25 - cell_spread(c) / (1.5 * base)) * 2.0, 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

Cell both(Cell a, Cell b) {
    return Cell(a.sum + b.sum, a.spread + b.spread, a.normal + b.normal);
}

// The cells of what a pixel covers: between base texels, which have their lobes as they are, and the levels of cells. `turn` is
// the cells' frame from the pixel's tangent frame, where these differ.
void gather(MapRecord record, uint code, mat3 turn, vec2 uv, Reach r, uint lobe_layer, out Cell cells[CELLS]) {
    for (uint i = 0u; i < CELLS; ++i) {
        cells[i] = Cell(vec4(0.0), 0.0, vec3(0.0));
    }
    float coarse = min(r.level, 1.0), level = max(r.level - 1.0, 0.0);
    for (float tap = 0.0; tap < r.taps; ++tap) {
        vec2 at = reach_tap(r, uv, tap);
        float share = coarse / r.taps;
        for (uint i = 0u; i < filter_cells(FILTER); ++i) {
            cells[i].sum += fetch(CELL_CLASSES, code, i, at, level) * share;
        }
        for (uint i = 0u; i < filter_cells(FILTER); i += 4u) {
            vec4 four = fetch(CELL_CLASSES, code, filter_cells(FILTER) + i / 4u, at, level) * share;
            for (uint k = 0u; k < 4u; ++k) {
                cells[i + k].spread += four[k];
            }
        }
        for (uint i = 0u; i < (record.upright != 0u ? 0u : filter_cells(FILTER)); ++i) {
            cells[i].normal += fetch(CELL_CLASSES, code, filter_normals(FILTER) + i, at, level).xyz * share;
        }
    }
    if (CAMERA) {
        // What texels without a frame lack; where all do, the base texels stand for all.
        float covered = 0.0;
        for (uint i = 0u; i < CELLS; ++i) {
            covered += cells[i].sum.w;
        }
        float factor = covered > LEAST_WEIGHT ? coarse / covered : 0.0;
        for (uint i = 0u; i < CELLS; ++i) {
            cells[i].sum *= factor;
            cells[i].spread *= factor;
            cells[i].normal *= factor;
        }
        coarse = factor > 0.0 ? coarse : 0.0;
    }
    for (float tap = 0.0; tap < r.taps; ++tap) {
        vec2 at = reach_tap(r, uv, tap);
        vec2 place = vec2(at.x, 1.0 - at.y) * r.size - 0.5, first = floor(place), part = place - first;
        // Base texels, where they count.
        for (uint k = 0u; k < (coarse < 1.0 ? 4u : 0u); ++k) {
            vec2 corner = vec2(k & 1u, k >> 1), share = mix(1.0 - part, part, corner);
            vec2 centre = (first + corner + 0.5) / r.size;
            vec3 normal = vec3(0.0);
            if (record.upright == 0u) {
                normal = fetch(MOMENT_CLASSES, record.moments, 0u, vec2(centre.x, 1.0 - centre.y), 0.0).xyz;
                normal = CAMERA ? moments_turned(turn, normal) : normal;
            }
            for (uint j = 0u; j < record.count; ++j) {
                vec4 lobe = fetch(MOMENT_CLASSES, record.moments, lobe_layer + j, vec2(centre.x, 1.0 - centre.y), 0.0);
                float weight = record.weights[j] * share.x * share.y * ((1.0 - coarse) / r.taps);
                lobe.xyz = CAMERA ? moments_turned(turn, lobe.xyz) : lobe.xyz;
                uint cell = moments_cell(filter_cells(FILTER), vec3(lobe.xy, 1.0 - lobe.z));
                // Selected, not indexed: lanes would go to memory for a place of their own.
                for (uint i = 0u; i < CELLS; ++i) {
                    float mine = i == cell ? weight : 0.0;
                    cells[i].sum += vec4(lobe.xyz, 1.0) * mine;
                    cells[i].spread += lobe.w * mine;
                    cells[i].normal += normal * mine;
                }
            }
        }
    }
}

#include "keep_clusters.glsl"
#include "gaussians.glsl"
#include "keep_texels.glsl"

// Stores the lobes of a material with moments.
void decode(ivec2 p, MapRecord record, vec2 uv, vec4 footprint, inout Found f) {
    Reach r = reach_of(MOMENT_CLASSES, record.moments, footprint);
    uint layer = record.upright != 0u ? 0u : 1u;
    if (filter_of_cells(FILTER)) {
        uint code = record.cells;
        mat3 turn = mat3(1.0);
        if (CAMERA && code != 0u) {
            code = objects[gbuffer_object(p)];
            mat3 camera = mat3(frame.world_from_view[0].xyz, frame.world_from_view[1].xyz, frame.world_from_view[2].xyz);
            turn = transpose(camera) * f.frame;
            f.frame = camera;
        }
        Cell cells[CELLS];
        gather(record, code, turn, uv, r, layer, cells);
        Cell all = Cell(vec4(0.0), 0.0, vec3(0.0));
        for (uint i = 0u; i < filter_cells(FILTER); ++i) {
            all = both(all, cells[i]);
            // A lobe about the normal is one of that direction.
            cells[i].normal = record.upright != 0u ? cells[i].sum.xyz : cells[i].normal;
        }
        all.normal = record.upright != 0u ? all.sum.xyz : all.normal;
        f.mean = all.normal / all.sum.w;
        f.area = record.facing * moments_area(vmf_concentration(all.spread / max(all.sum.w, LEAST_WEIGHT)), record.lobes);
        if (FILTER == FILTER_VMF) {
            float one = cell_kept(all, LENGTH_OF_ONE);
            keep_cell(p, f, all, one);
            for (uint i = 0u; i < 4u; ++i) {
                Cell quarter = both(cells[2u * i], cells[2u * i + 1u]);
                float kept = cell_kept(quarter, LENGTH_OF_QUARTERS);
                keep_cell(p, f, quarter, (1.0 - one) * kept);
                keep_cell(p, f, cells[2u * i], (1.0 - one) * (1.0 - kept));
                keep_cell(p, f, cells[2u * i + 1u], (1.0 - one) * (1.0 - kept));
            }
        } else {
            for (uint i = 0u; i < filter_cells(FILTER); ++i) {
                keep_cell(p, f, cells[i], 1.0);
            }
        }
    } else if (FILTER == FILTER_CLUSTERS) {
        decode_clusters(p, record, uv, r, layer, f);
    } else if (filter_of_gaussians(FILTER)) {
        decode_gaussians(p, record, uv, r, f);
    } else if (filter_peaks(FILTER) != 0u) {
        decode_peaks(p, record, uv, r, layer, f);
    } else if (FILTER == FILTER_BRUTE_FORCE) {
        decode_base(p, record, uv, r, layer, f);
    } else {
        uint count = filter_merges(FILTER) ? min(record.count, 1u) : record.count;
        vec3 normal = record.upright != 0u ? vec3(0.0) : look_up(MOMENT_CLASSES, record.moments, 0u, uv, r).xyz;
        float constant = 0.0;
        for (uint i = 0u; FILTER == FILTER_FIXED && i < count; ++i) {
            // The map's mean: its last level.
            constant += record.weights[i] * fetch(MOMENT_CLASSES, record.moments, layer + i, uv, 32.0).w;
        }
        for (uint i = 0u; i < count; ++i) {
            float weight = filter_merges(FILTER) ? 1.0 : record.weights[i];
            if (filter_of_slopes(FILTER)) {
                vec4 first = look_up(MOMENT_CLASSES, record.moments, layer + 2u * i, uv, r);
                keep_slopes(p, f, first, look_up(MOMENT_CLASSES, record.moments, layer + 2u * i + 1u, uv, r).x, weight);
                continue;
            }
            vec4 moments = look_up(MOMENT_CLASSES, record.moments, layer + i, uv, r);
            moments.w = FILTER == FILTER_FIXED ? constant : moments.w;
            float base = FILTER == FILTER_VMF1 ? vmf_concentration(moments.w) : moments.w;
            f.area = record.facing * moments_area(base, record.lobes);
            normal = record.upright != 0u ? moments.xyz : normal;
            f.mean = i == 0u ? normal : f.mean;
            keep(p, f, moments.xyz, moments_concentration(FILTER, moments, LITERAL), weight, normal);
        }
    }
    if (record.count == 0u) {
        f.mean = look_up(MOMENT_CLASSES, record.moments, 0u, uv, r).xyz;
    }
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(uvec2(p), frame.extent.xy)) || !gbuffer_covered(p)) {
        return;
    }
    MapRecord record = maps[gbuffer_material(p)];
    vec2 uv = gbuffer_uv(p) * record.tiling;
    vec4 footprint = gbuffer_footprint(p) * record.tiling.xyxy;
    vec3 n = gbuffer_normal(p);
    vec4 t = gbuffer_tangent(p);

    Factors f;
    f.albedo = colour(ALBEDO_CLASSES, record.places.x, uv, footprint, record.without);
    f.specular = colour(SPECULAR_CLASSES, record.places.y, uv, footprint, 1.0);
    f.alpha = NO_ALPHA;
    if (ROUGHNESS_CLASSES != 0u) {
        float v = fetch(ROUGHNESS_CLASSES, record.places.w, 0u, uv, 0.0).x;
        f.alpha = record.places.w != 0u ? alpha_by_rule(record.rule.x, v, record.rule.y) : NO_ALPHA;
    }
    f.kernel = 0.0;
    if (GEOMETRIC) {
        f.kernel = geometric_kernel(p, n);
    }
    if (NORMAL_CLASSES != 0u) {
        vec2 xy = fetch(NORMAL_CLASSES, record.places.z, 0u, uv, 0.0).xy;
        vec3 local = vec3(xy, sqrt(max(1.0 - dot(xy, xy), 0.0)));
        vec3 bent = normalize(t.xyz * local.x + cross(n, t.xyz) * (t.w * local.y) + n * local.z);
        n = record.places.z != 0u && t.w != 0.0 ? bent : n;
    }
    if (LOBES != 0u) {
        Found found = Found(tangent_frame(n, t), f.kernel, 0u, 0.0, vec3(0.0), record.lobes, 1.0);
        if (record.moments != 0u) {
            decode(p, record, uv, footprint, found);
        } else if (filter_of_slopes(FILTER)) {
            if (record.count > 0u) {
                keep_slopes(p, found, vec4(0.0, 0.0, vec2(1.0 / max(record.concentration, LEAST_SLOPE_CONCENTRATION))), 0.0, 1.0);
            }
        } else if (record.count > 0u) {
            found.area = moments_area(record.concentration, record.lobes);
            keep(p, found, vec3(0.0), record.concentration, 1.0, vec3(0.0));
        }
        if (found.count < LOBES) {
            imageStore(lobes, ivec3(p, int(found.count)), uvec4(0u));
        }
        // What predicts bandwidth knows of one lobe only.
        f.alpha = found.count > 0u ? clamp(moments_alpha(found.sharpest, record.lobes), LEAST_ALPHA, record.rule.y) : f.alpha;
        f.kernel = found.count > 0u ? 0.0 : f.kernel;
        n = filter_of_slopes(FILTER) && record.count > 0u ? n : found.frame * moments_direction(found.mean);
    }
    imageStore(normals, p, vec4(n, tangent_encode(n, t.xyz, t.w)));
    imageStore(factors, p, factors_pack(f));
}
