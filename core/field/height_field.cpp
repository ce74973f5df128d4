#include "core/field/height_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/error.h"
#include "core/image/channels.h"
#include "core/image/colour.h"
#include "core/image/resample.h"

namespace relit {
namespace {

float fraction(float value) {
    return value >= 0 ? std::min(value, 1.0f) : 0.0f;  // NaN too
}

HeightRange finite_range(const Image& heights) {
    float lo = std::numeric_limits<float>::infinity();
    float hi = -lo;
    for (const float h : heights.values) {
        if (!std::isfinite(h)) continue;
        lo = std::min(lo, h);
        hi = std::max(hi, h);
    }
    if (lo > hi)
        throw Error(error_code::image_broken, "the height map has no texel with a finite height");
    return {lo, hi};
}

void rescale(Image& heights, HeightRange range) {
    const double span = range.max - range.min;
    for (float& h : heights.values)
        if (std::isfinite(h)) h = span > 0 ? float((h - range.min) / span) : 0.0f;
}

// Texels without a finite height take part in interpolation with 0 and are masked.
void mask_non_finite(HeightField& field) {
    for (std::size_t i = 0; i < field.heights.values.size(); ++i) {
        float& h = field.heights.values[i];
        if (std::isfinite(h)) continue;
        h = 0;
        if (field.alpha.empty()) field.alpha = Image(field.width(), field.height(), 1, 1.0f);
        field.alpha.values[i] = 0;
        if (field.no_height.empty()) field.no_height.resize(field.heights.texels());
        field.no_height[i] = true;
    }
}

Image resized(Image image, const HeightField& field, const Executor& executor) {
    if (image.width == field.width() && image.height == field.height()) return image;
    return resample(image, field.width(), field.height(), executor);
}

}  // namespace

HeightField height_field_from(Image stored, bool has_alpha, bool fractions) {
    HeightField field;
    if (has_alpha) {
        field.alpha = alpha_channel(stored);
        for (float& a : field.alpha.values) a = fraction(a);
    }
    field.heights = luminance_channel(std::move(stored), has_alpha);
    const HeightRange range = finite_range(field.heights);
    if (!fractions && (range.min < 0 || range.max > 1)) {
        rescale(field.heights, range);
        field.rescaled_from = range;
    }
    mask_non_finite(field);
    return field;
}

void set_alpha(HeightField& field, Image stored, bool has_alpha, const Executor& executor) {
    Image alpha = has_alpha ? alpha_channel(stored) : luminance_channel(std::move(stored), false);
    for (float& a : alpha.values) a = fraction(a);
    field.alpha = resized(std::move(alpha), field, executor);
    for (float& a : field.alpha.values) a = fraction(a);  // bicubic overshoot
    for (std::size_t i = 0; i < field.no_height.size(); ++i)
        if (field.no_height[i]) field.alpha.values[i] = 0;
}

void set_albedo(HeightField& field, const Image& stored, bool has_alpha, bool encoded,
                const Executor& executor) {
    Image albedo = rgb_channels(stored, has_alpha);
    if (encoded) decode_srgb(albedo);
    for (float& a : albedo.values) a = std::isfinite(a) ? std::max(a, 0.0f) : 0.0f;
    field.albedo = resized(std::move(albedo), field, executor);
    for (float& a : field.albedo.values) a = std::max(a, 0.0f);  // bicubic overshoot
}

void set_bump(HeightField& field, Image stored, bool has_alpha, bool fractions,
              const Executor& executor) {
    field.bump = resized(height_field_from(std::move(stored), has_alpha, fractions).heights, field,
                         executor);
}

HeightField smaller_field(const HeightField& field, int width, int height, const Executor& executor,
                          const std::stop_token& stop) {
    HeightField small;
    small.heights = resample(field.heights, width, height, executor, stop);
    if (!field.alpha.empty()) small.alpha = resample(field.alpha, width, height, executor, stop);
    if (!field.bump.empty()) small.bump = resample(field.bump, width, height, executor, stop);
    if (!field.albedo.empty()) small.albedo = resample(field.albedo, width, height, executor, stop);
    small.rescaled_from = field.rescaled_from;
    return small;
}

}  // namespace relit
