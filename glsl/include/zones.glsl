// Exposure zones in false colours, and marks of clipped and black pixels. Reference: src/client/zones.rs.

const int ZONES = 13;
const float SECOND_ZONE = 0.0043853;
const vec3 ZONE_COLORS[ZONES] = vec3[ZONES](
    vec3(0.00335, 0.00335, 0.00335),
    vec3(0.01229, 0.00561, 0.06301),
    vec3(0.02956, 0.02029, 0.32314),
    vec3(0.02416, 0.12214, 0.58408),
    vec3(0.02315, 0.34670, 0.46208),
    vec3(0.04971, 0.42327, 0.14996),
    vec3(0.18447, 0.18447, 0.18447),
    vec3(0.39157, 0.55834, 0.05951),
    vec3(0.78354, 0.64448, 0.04231),
    vec3(0.87137, 0.35153, 0.02956),
    vec3(0.80695, 0.12214, 0.02519),
    vec3(0.63760, 0.02315, 0.04519),
    vec3(1.00000, 1.00000, 1.00000)
);

const float CLIPPED = 0.995;
const float BLACK = 1e-5;
const vec3 CLIPPED_MARK = vec3(1.0, 0.05, 0.02);
const vec3 BLACK_MARK = vec3(0.03, 0.12, 1.0);

// The colour of the zone of an exposed luminance.
vec3 zone_color(float exposed) {
    float bound = SECOND_ZONE;
    int zone = 0;
    for (int k = 1; k < ZONES; ++k) {
        zone += exposed >= bound ? 1 : 0;
        bound *= 2.0;
    }
    return ZONE_COLORS[zone];
}

// A display-linear colour, with stripes where it is clipped or black.
vec3 with_marks(vec3 rgb, float ceiling, ivec2 at) {
    float most = max(rgb.r, max(rgb.g, rgb.b));
    bool stripe = (((at.x + at.y) >> 2) & 1) == 0;
    if (stripe && most >= CLIPPED * ceiling) {
        return CLIPPED_MARK;
    }
    return stripe && most <= BLACK ? BLACK_MARK : rgb;
}
