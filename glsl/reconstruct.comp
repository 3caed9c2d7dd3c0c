#version 460
#extension GL_GOOGLE_include_directive : require
#define COMPUTE
#include "include/layers.glsl"

// The same as reconstruct.frag, for a Gaussian whose level of detail is the same for the whole picture. A workgroup loads the texels that
// its pixels read of both levels once, into memory that it shares: each of them is read by up to 25 pixels, or 100 on the second level.

// A square of texels of a level in the shared memory: the place of the first one there, texels along each axis, and the first texel.
struct Tile {
    int start;
    int width;
    ivec2 first;
};

#define TEXELS Tile
#include "include/reconstruct.glsl"

layout(set = 0, binding = 8, rgba32f) writeonly uniform image2D picture;

// Pixels of a workgroup along each axis; the same as in src/client/pass/reconstruct.rs.
const int GROUP = 16;
layout(local_size_x = 16, local_size_y = 16) in;

// Texels of a tile along each axis. With d texels from the place p of the group's first pixel to that of its last one, the tile begins at
// floor(p - R - 1/2), and the TAPS texels of a pixel at ceil(p' - R - 1/2), p <= p' <= p + d; the four texels of a narrow kernel are
// among the five of the usual one. So no pixel reads before the tile, and ceil(x + d) - floor(x) <= d + 1 for a whole d: d + 1 + TAPS
// texels suffice. The host sees to it that d is less than GROUP on the first level and GROUP / 2 on the second one, by more than what
// rounding adds. Both tiles take 14,624 bytes at most, where TAPS is 8.
const int NEAR = GROUP + 1 + TAPS;
const int FAR = GROUP / 2 + 1 + TAPS;

shared vec4 tiles[NEAR * NEAR + FAR * FAR];

vec4 texel_at(Tile tile, Level level, ivec2 at) {
    ivec2 i = at - tile.first;
    return tiles[tile.start + i.y * tile.width + i.x];
}

// Loads the tile of this width for a workgroup whose first pixel is at `p`; texels beyond the edge are those at the edge.
Tile load(sampler2D image, Level level, vec2 p, int start, int width) {
    Tile tile = Tile(start, width, ivec2(floor(p - 0.5 * float(TAPS) - 0.5)));
    for (int i = int(gl_LocalInvocationIndex); i < width * width; i += GROUP * GROUP) {
        ivec2 at = tile.first + ivec2(i % width, i / width);
        tiles[start + i] = texelFetch(image, clamp(at, ivec2(0), level.size - 1), 0);
    }
    return tile;
}

// Every invocation of a workgroup calls it, also those beyond the edge of the picture, which are not `drawn`.
vec4 sums_at(sampler2D image, sampler2D near, sampler2D far, float lod, const uint extent, bool drawn) {
    vec2 place = place_of(vec2(gl_GlobalInvocationID.xy) + 0.5);
    vec4 sums = vec4(0.0);
    if (extent == TEXEL || extent == FILTERED) {
        if (drawn) {
            sums = extent == TEXEL ? texelFetch(image, ivec2(place), 0) : filtered_at(image, place);
        }
        return sums;
    }
    Levels first = levels_at(image, near, far, lod, place_of(vec2(gl_WorkGroupID.xy * uint(GROUP)) + 0.5));
    // The other stream has been read.
    barrier();
    Tile near_tile = load(near, first.near, first.p_near, 0, NEAR);
    Tile far_tile = near_tile;
    if (extent == TWO_LEVELS) {
        far_tile = load(far, first.far, first.p_far, NEAR * NEAR, FAR);
    }
    barrier();
    if (drawn) {
        sums = gaussian(near_tile, far_tile, levels_at(image, near, far, lod, place), extent);
    }
    return sums;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    bool drawn = all(lessThan(pixel, imageSize(picture)));
    vec4 of_camera = vec4(0.0);
    vec4 of_light = vec4(0.0);
    if (CAMERA != ABSENT) {
        of_camera = sums_at(camera, camera_near, camera_far, push.lod.x, CAMERA, drawn);
    }
    if (LIGHT != ABSENT) {
        of_light = sums_at(light, light_near, light_far, push.lod.y, LIGHT, drawn);
    }
    if (drawn) {
        imageStore(picture, pixel, vec4(radiance(of_camera, of_light), 1.0));
    }
}
