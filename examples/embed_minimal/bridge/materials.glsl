// This host uses passband's own materials.
#include "../../../glsl/bridge/materials.glsl"
