// What a texel keeps of the lobes under it, in layers of four numbers; mips are averages (src/distribution/filter.rs is the f64
// twin). Lobes are in the tangent frame, vectors are stored as x, y, 1 - z: the complement keeps what 32 bits can tell of a sharp
// lobe.
//   naive, fixed, toksvig, toksvig-lobe: mean direction; the mean concentration. toksvig merges lobes, the others keep them apart
//   lean, leadr; lean-lobe:              mean slope, mean products xx and yy; mean product xy. lean-lobe keeps lobes apart
//   vmf1:                                characteristic vector of all lobes; their mean spread
//   clusters:                            of a base texel each lobe as naive has it; from level 1 on, in images of half the size and of
//                                        numbers of 16 bits, the moments of each cluster, as clusters.glsl has them: mass, x, y, xx;
//                                        then xy, yy of two clusters in a layer, or, if lobes are not about the normal, of each with
//                                        its normal; then, where specular colours go together with lobes, mass times the colour of
//                                        each. Base texels have theirs in the layer behind their lobes
//   fournier4, fournier7:                the same of a base texel; from level 1 on, in images of half the size, lobes of each texel:
//                                        direction as oct.glsl has it, concentration, mass, which is 0 of none; then, if
//                                        lobes are not about the normal, the normals of as many
//   bruteforce:                          of a base texel each lobe as naive has it
//   gmm, gmm-unaligned:                  the same of a base texel; in images of their own, from level 0 on, the four Gaussians of each
//                                        texel, as gaussians.glsl has them: mass, x, y, mean square; then, if lobes are not about
//                                        the normal, the normals of as many: mass times x, y of their place in the plane
//   vmf4, vmf8, vmf:                     of a base texel each lobe as vmf1 has it; from level 1 on, in images of half the size,
//                                        of each cell weight times characteristic vector (w x, w y, w - w z) and weight w; then
//                                        weight times spread, four cells in a layer; then, if lobes are not about the normal,
//                                        weight times the normal of each cell's texels (w x, w y, w - w z). With bins in camera space
//                                        the cells are an object's own, in view space, of weight 0 where it shows nothing
// Lobes kept apart have the weights that they have everywhere. In front, if lobes are not about the normal: the mean normal.
#ifndef MOMENTS_GLSL
#define MOMENTS_GLSL
#include "vmf.glsl"

// In the order of src/distribution/filter.rs, after those that store nothing.
const uint FILTER_NAIVE = 2u;
const uint FILTER_FIXED = 3u;
const uint FILTER_TOKSVIG = 4u;
const uint FILTER_TOKSVIG_LOBE = 5u;
const uint FILTER_LEAN = 6u;
const uint FILTER_LEAN_LOBE = 7u;
const uint FILTER_LEADR = 8u;
const uint FILTER_VMF1 = 9u;
const uint FILTER_VMF4 = 10u;
const uint FILTER_VMF8 = 11u;
const uint FILTER_VMF = 12u;
const uint FILTER_CLUSTERS = 13u;
const uint FILTER_FOURNIER4 = 14u;
const uint FILTER_FOURNIER7 = 15u;
const uint FILTER_BRUTE_FORCE = 16u;
const uint FILTER_GMM = 17u;
const uint FILTER_GMM_UNALIGNED = 18u;

// What a concentration is of.
const uint LOBES_STAY = 0u;     // nothing: the material's own lobes stay
const uint LOBES_ALPHA = 1u;    // a lobe: alpha is sqrt(2 / concentration)
const uint LOBES_EXPONENT = 2u; // a cosine power, whose mean cosine is exact: alpha is sqrt(2 spread)
const uint LOBES_GGX = 3u;      // GGX of that alpha, which has another mean cosine

const uint MOST_BASE_LOBES = 4u; // of a material, that are filtered
const uint CELLS = 8u;

// Lobes of less weight are none.
const float LEAST_WEIGHT = 1e-6;

bool filter_of_slopes(uint filtering) {
    return filtering == FILTER_LEAN || filtering == FILTER_LEAN_LOBE || filtering == FILTER_LEADR;
}

bool filter_of_cells(uint filtering) {
    return filtering == FILTER_VMF4 || filtering == FILTER_VMF8 || filtering == FILTER_VMF;
}

bool filter_of_gaussians(uint filtering) {
    return filtering == FILTER_GMM || filtering == FILTER_GMM_UNALIGNED;
}

// Whether lobes are elliptic, of normals that follow the half vector.
bool filter_elliptic(uint filtering) {
    return filtering == FILTER_CLUSTERS || filter_of_gaussians(filtering);
}

// Lobes of a texel, where these are not averaged; 0 for other filters.
uint filter_peaks(uint filtering) {
    return filtering == FILTER_FOURNIER4 ? 4u : (filtering == FILTER_FOURNIER7 ? 7u : 0u);
}

uint filter_cells(uint filtering) {
    return filtering == FILTER_VMF4 ? 4u : CELLS;
}

// The layer of cells with the first normal.
uint filter_normals(uint filtering) {
    return filtering == FILTER_VMF4 ? 5u : CELLS + 2u;
}

// Whether lobes that are not of one direction are merged.
bool filter_merges(uint filtering) {
    return filtering == FILTER_TOKSVIG || filtering == FILTER_LEAN || filtering == FILTER_LEADR || filtering == FILTER_VMF1;
}

// Less spread than this beyond what is known comes of rounding.
const float MOMENTS_ROUNDING = 2.0 * VMF_LEAST_SPREAD;

// 1 - |r|, at least `known`.
float moments_spread(vec3 r, float known) {
    float square = r.z * (2.0 - r.z) - dot(r.xy, r.xy); // 1 - |r|^2
    float spread = square / (1.0 + sqrt(max(1.0 - square, 0.0)));
    return spread > known + MOMENTS_ROUNDING ? spread : known;
}

// The direction of a vector that is stored as x, y, 1 - z.
vec3 moments_direction(vec3 r) {
    vec3 v = vec3(r.xy, 1.0 - r.z);
    float square = dot(v, v);
    return square > 0.0 ? v * inversesqrt(square) : vec3(0.0, 0.0, 1.0);
}

// A vector that is stored as x, y, 1 - z, turned.
vec3 moments_turned(mat3 turn, vec3 r) {
    vec3 v = turn * vec3(r.xy, 1.0 - r.z);
    return vec3(v.xy, 1.0 - v.z);
}

// The concentration of the lobe that a filter with lobes of directions finds in moments.
float moments_concentration(uint filtering, vec4 moments, bool literal) {
    if (filtering == FILTER_VMF1) {
        float spread = moments_spread(moments.xyz, moments.w);
        return literal ? vmf_literal_concentration(spread) : vmf_concentration(spread);
    }
    float kappa = moments.w;
    if (filtering == FILTER_TOKSVIG || filtering == FILTER_TOKSVIG_LOBE) {
        float off = moments_spread(moments.xyz, 0.0);
        kappa *= (1.0 - off) / (1.0 - off + kappa * off);
    }
    return kappa;
}

// Alpha of a lobe of this concentration.
float moments_alpha(float kappa, uint lobes) {
    return sqrt(lobes == LOBES_EXPONENT ? 2.0 * vmf_spread(kappa) : 2.0 / max(kappa, 1e-12));
}

// The mean cosine over solid angle of a material's lobe of this concentration (src/distribution/effective.rs has GGX's).
float moments_area(float kappa, uint lobes) {
    float square = clamp(2.0 / max(kappa, 1e-12), 1e-6, 1.0), c = sqrt(max(1.0 - square, 0.0));
    float ratio = c < 1e-2 ? 1.0 + c * c * (1.0 / 3.0) : 0.5 * log((1.0 + c) * (1.0 + c) / square) / c; // artanh(c) / c
    return lobes == LOBES_GGX ? 1.0 / (1.0 + square * ratio) : max(1.0 - vmf_spread(kappa), 0.05);
}

// The cell of a direction: the quadrant about z, and of eight cells its half nearer to z or to the horizon
// (src/distribution/partition.rs).
uint moments_cell(uint cells, vec3 mu) {
    uint quadrant = (mu.x < 0.0 ? 1u : 0u) + (mu.y < 0.0 ? 2u : 0u);
    float z = max(mu.z, 0.0);
    bool low = z * z < dot(mu.xy, mu.xy);
    return cells == 4u ? quadrant : 2u * quadrant + (low ? 1u : 0u);
}

// Slopes (src/distribution/slope.rs).
const float LEAST_SLOPE_COSINE = 0.08;
const float LEAST_SLOPE_VARIANCE = 1e-7;
const float LEAST_SLOPE_CONCENTRATION = 1e-2;

vec2 slope_of(vec3 m) {
    return -m.xy / max(m.z, LEAST_SLOPE_COSINE);
}

// Mean products xx, xy, yy of the slopes of a lobe about slope b, of its own variance alone or carried to b.
vec3 slope_products(vec2 b, float kappa, bool carried) {
    float variance = 1.0 / max(kappa, LEAST_SLOPE_CONCENTRATION);
    vec3 square = vec3(b.x * b.x, b.x * b.y, b.y * b.y);
    vec3 own = vec3(variance, 0.0, variance);
    return square + (carried ? (1.0 + square.x + square.z) * (own + variance * square) : own);
}

#endif
