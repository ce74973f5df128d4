// A scene ready to render: plain data, images loaded. For render(); filled by whoever knows where
// images come from.
#pragma once

#include <memory>
#include <vector>

#include "core/field/height_field.h"
#include "core/field/solid.h"
#include "core/light/light.h"
#include "core/shade/material.h"

namespace relit {

struct Scene {
    std::shared_ptr<const HeightField> field;
    double relief = 0.15;       ///< z of height 1 in scene units (1 = the map's width), > 0
    double bump_relief = 0.01;  ///< z of 1 in the field's bump map, scene units, > 0
    Base base;
    double normal_scale = 1;  ///< multiplies the slopes for highlights and the normal layer, >= 0
    std::vector<Light> lights{PointLight{}};  ///< at least one
    Material material;
};

}  // namespace relit
