// Real reliefs of the test data, by name, loaded as a server would load them.
#pragma once

#include "core/field/height_field.h"
#include "core/io/decode.h"
#include "tests/support/data.h"
#include "tests/support/maps.h"

namespace relit::test {

struct ReliefFile {
    const char* name;
    const char* heights;
    const char* alpha;   // or null
    const char* albedo;  // or null
};

inline constexpr ReliefFile relief_files[] = {
    {"bunny", "heights/bunny_512_height.png", "heights/bunny_512_alpha.png", nullptr},
    {"dragon", "heights/dragon_512_height.png", "heights/dragon_512_alpha.png", nullptr},
    {"plato", "heights/plato_512_height.png", "heights/plato_512_alpha.png", nullptr},
    {"spot", "heights/spot_512_height.png", "heights/spot_512_alpha.png",
     "heights/spot_512_albedo.png"},
    {"st_helens", "dem/st_helens_f32.tif", nullptr, nullptr},
    {"jacksboro", "dem/jacksboro_u16.png", nullptr, nullptr},
};

inline HeightField load_relief(const ReliefFile& file) {
    const auto load = [](const char* name) { return decode(read_data(name)); };
    const DecodedImage heights = load(file.heights);
    HeightField field = height_field_from(
        heights.image, heights.info.has_alpha,
        heights.info.type == SampleType::uint8 || heights.info.type == SampleType::uint16);
    if (file.alpha) {
        const DecodedImage alpha = load(file.alpha);
        set_alpha(field, alpha.image, alpha.info.has_alpha, executor());
    }
    if (file.albedo) {
        const DecodedImage albedo = load(file.albedo);
        set_albedo(field, albedo.image, albedo.info.has_alpha, true, executor());
    }
    return field;
}

}  // namespace relit::test
