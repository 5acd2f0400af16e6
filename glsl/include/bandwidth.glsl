// How the bandwidth of light becomes bandwidth in the image, and that a level (Bagher et al. 2011, equations 3, 5 and 9).
// src/frequency/operators.rs and level.rs are the f64 twins.
#ifndef BANDWIDTH_GLSL
#define BANDWIDTH_GLSL

const int OPERATOR_BOX = 0;
const int OPERATOR_CLIPPED = 1;
const int OPERATOR_COVARIANCE = 2;

const float BANDWIDTH_LEAST_COSINE = 0.02;

// Image bandwidth in cycles/pixel. Light and lobe in cycles/radian (either may be huge, not infinite); principal curvatures in
// 1/m, positive where convex; length of the ray in metres; cosine between normal and viewer; radians that a pixel spans. The
// operator should be a constant.
float image_bandwidth(int operator, float light, float lobe, vec2 curvatures, float distance, float cosine, float pixel) {
    float least = min(light, lobe), most = max(light, lobe);
    float ratio = most > 0.0 ? least / most : 0.0;
    float angular = operator == OPERATOR_COVARIANCE ? least * inversesqrt(1.0 + ratio * ratio) : least;
    float sheared = operator == OPERATOR_BOX ? light + least : angular + angular;
    float reach = distance / max(cosine, BANDWIDTH_LEAST_COSINE);
    vec2 along = abs(angular + reach * curvatures * sheared);
    return max(along.x, along.y) * pixel;
}

// The largest angle in radians between the rays of neighbouring pixels at `ray` on the image plane at distance 1, of pixels
// `pixel_step` wide and high there.
float pixel_angle(vec2 ray, vec2 pixel_step) {
    return max(pixel_step.x, pixel_step.y) * inversesqrt(1.0 + dot(ray, ray));
}

// The coarsest level of at least `samples_per_cycle` samples a cycle of `bandwidth` cycles/pixel; 0 is one pixel.
int bandwidth_level(float bandwidth, float samples_per_cycle, int finest, int coarsest) {
    float samples = clamp(bandwidth * samples_per_cycle, exp2(-64.0), exp2(64.0));
    return clamp(int(floor(-log2(samples))), finest, coarsest);
}

#endif
