// Colour for the texels at a mask's soft edge: those with 0 < alpha < 0.5 take it from the nearest
// texel that is material, so that edges have no fringe. For render(). Source: integrated model,
// section 5.
#pragma once

#include <optional>
#include <vector>

#include "core/base/rect.h"
#include "core/field/height_field.h"

namespace relit {

/// Finds the nearest solid texel, by distance between centres; of equally near ones the least far
/// to the side, then the left, then the upper one.
class NearestSolid {
public:
    explicit NearestSolid(const HeightField& field);

    /// None when the whole map is masked.
    [[nodiscard]] std::optional<TexelIndex> find(int i, int j) const;

private:
    int width_;
    int height_;
    bool any_ = false;            // is there a solid texel at all
    std::vector<int> in_column_;  // row of the nearest solid texel in the same column, -1 = none
};

}  // namespace relit
