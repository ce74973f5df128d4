// Scenes that are legal, rendered over small maps: whatever numbers they hold, the picture is one of
// numbers, and the same with any instructions.
#include <cmath>
#include <limits>
#include <string>

#include "core/base/simd.h"
#include "server/scenes/picture_file.h"
#include "server/scenes/scene_loading.h"
#include "server/schema/scene_json.h"
#include "tests/fuzz/claims.h"
#include "tests/fuzz/targets.h"

namespace relit::fuzz {
namespace {

using namespace server;

// What an image's id stands for, by its first letter; anything else is a hilly map.
DecodedImage map_of(std::string_view id) {
    const char kind = id.empty() ? '?' : id.front();
    const int width = kind == 'o' ? 1 : kind == 'r' ? 40 : 12;
    const int height = kind == 'o' || kind == 'r' ? 1 : 9;
    const int channels = kind == 'c' || kind == 'e' ? 3 : kind == 'a' ? 4 : 1;
    Image image(width, height, channels);
    for (std::size_t i = 0; i < image.values.size(); ++i) {
        const float wave = 0.5f + 0.5f * std::sin(0.7f * float(i));
        image.values[i] = kind == 'f' ? 0.5f : kind == 'w' && i % 5 == 0 ? 1e38f * wave : wave;
        if (kind == 'n' && i % 3 == 0) image.values[i] = std::numeric_limits<float>::quiet_NaN();
    }
    const SampleType type = kind == 'w' || kind == 'n' ? SampleType::float32 : SampleType::uint16;
    return {{.type = type,
             .width = width,
             .height = height,
             .channels = channels,
             .has_alpha = channels == 4},
            std::move(image)};
}

// Small, so that many scenes a second are rendered.
Limits small_limits() {
    Limits limits;
    limits.max_output_pixels = 64 * 64;
    limits.max_lights = 3;
    limits.max_scene_cost = 100'000;
    return limits;
}

}  // namespace

void render(std::string_view input) {
    static const Limits limits = small_limits();
    SceneDescription description;
    if (!accepts([&] { description = parse_scene(input, limits.max_lights); })) return;
    const std::string text = scene_json(description);
    const Executor executor(1);
    SharedCache cache(1 << 20);
    Scene scene;
    const auto load = [&] {
        scene = load_scene(
            description,
            [](const ImageSource& source) {
                return SharedBytes{nullptr, source.text};
            },
            map_of, limits, executor, cache);
    };
    if (!accepts(load)) return;
    std::string first;
    for (const Simd simd : available_simd()) {
        const RenderControl control{.executor = executor, .simd = simd, .cache = &cache};
        const Picture picture = render(scene, picture_output(description.output), control);
        for (const float number : picture.pixels.values)
            claim(std::isfinite(number), "a picture has numbers only: " + text);
        const PictureFile file = picture_file(scene, description, text, control);
        claim(!file.bytes.empty(), "a picture has a file");
        if (first.empty()) first = file.bytes;
        claim(file.bytes == first, "a picture is the same with any instructions: " + text);
    }
}

}  // namespace relit::fuzz
