// Images of several layers, such as the pictures of two eyes. A shader that includes this file is compiled twice: as it stands, and with
// LAYERS defined. Then its images are arrays, and it runs once for each layer. A fragment shader gets the layer from fullscreen.vert, of
// which each instance covers one; a compute shader, which defines COMPUTE first, gets it from the third coordinate of its workgroup.

#ifdef LAYERS
#ifdef COMPUTE
#define LAYER int(gl_WorkGroupID.z)
#else
layout(location = 0) flat in int drawn_layer;
#define LAYER drawn_layer
#endif
// A macro is not expanded within itself, so that the names on the right are those of the language.
#define sampler2D sampler2DArray
#define image2D image2DArray
#define texelFetch(image, at, level) texelFetch(image, ivec3(at, LAYER), level)
#define textureSize(image, level) textureSize(image, level).xy
#define imageLoad(image, at) imageLoad(image, ivec3(at, LAYER))
#define imageStore(image, at, value) imageStore(image, ivec3(at, LAYER), value)
#define imageSize(image) imageSize(image).xy
#else
#define LAYER 0
#endif
