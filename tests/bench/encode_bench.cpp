// Milliseconds and bytes per file of a finished picture, beside OpenImageIO's writers. Run:
// build/bench/tests/bench/relit_bench --benchmark_filter=png_\|jpeg_\|webp_
//
// Pictures: RGB, terrain with a coloured ground under a light at 30 degrees, 512 to 2048 squared.
// Ours start at the floats; OpenImageIO, which would take longer for those, at finished bytes.
#include <benchmark/benchmark.h>

#include <cmath>
#include <map>
#include <memory>
#include <stdexcept>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "core/base/angle.h"
#include "core/io/encode.h"
#include "core/io/quantise.h"
#include "core/render/render.h"
#include "tests/bench/terrain.h"

namespace relit::bench {
namespace {

constexpr double relief = 0.1;

// From ochre in the valleys to pale grey on the heights, in the pattern of the next texels' heights
// too: as busy as a photograph of stone.
Image ground(const HeightField& field) {
    Image albedo(field.width(), field.height(), 3);
    for (int y = 0; y < albedo.height; ++y)
        for (int x = 0; x < albedo.width; ++x) {
            const float there = field.heights.at(x * 7 % albedo.width, y * 7 % albedo.height);
            const float pale = 0.5f * (field.heights.at(x, y) + there);
            albedo.at(x, y, 0) = 0.45f + 0.3f * pale;
            albedo.at(x, y, 1) = 0.30f + 0.4f * pale;
            albedo.at(x, y, 2) = 0.15f + 0.5f * pale;
        }
    return albedo;
}

Image rendered_terrain(int size) {
    Scene scene;
    HeightField field = terrain(size);
    field.albedo = ground(field);
    scene.field = std::make_shared<const HeightField>(std::move(field));
    scene.relief = relief;
    scene.material.depth = 0.004;
    PointLight light;
    light.position = {-0.05, 0.6, relief + 0.55 * std::tan(radians(30.0))};
    scene.lights = {light};
    return render(scene, {}, {Executor(2)}).pixels;
}

const Image& picture(int size) {
    static std::map<int, Image> made;
    const auto found = made.find(size);
    return found != made.end() ? found->second
                               : made.emplace(size, rendered_terrain(size)).first->second;
}

void report(benchmark::State& state, std::size_t bytes) { state.counters["bytes"] = double(bytes); }

// --- OpenImageIO ---------------------------------------------------------------------------------

std::size_t write_with_openimageio(const char* plugin, OIIO::ImageSpec spec,
                                   const std::vector<std::uint8_t>& samples) {
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    OIIO::Filesystem::IOProxy* proxy = &memory;
    spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    const auto output = OIIO::ImageOutput::create(plugin);
    if (!output || !output->open("picture", spec) ||
        !output->write_image(OIIO::TypeDesc::UINT8, samples.data()) || !output->close())
        throw std::runtime_error("OpenImageIO could not write");
    return bytes.size();
}

void run_openimageio(benchmark::State& state, const char* plugin) {
    const Image& image = picture(int(state.range(0)));
    OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::UINT8);
    spec.attribute("CompressionQuality", 85);  // read by JPEG
    spec.attribute("jpeg:subsampling", "4:4:4");
    const auto samples = quantised(image, Executor(1), {});
    std::size_t bytes = 0;
    for (auto _ : state) bytes = write_with_openimageio(plugin, spec, samples);
    report(state, bytes);
}

void png_openimageio_default(benchmark::State& state) { run_openimageio(state, "png"); }
void jpeg_openimageio(benchmark::State& state) { run_openimageio(state, "jpeg"); }

// --- Ours ----------------------------------------------------------------------------------------

void run_ours(benchmark::State& state, PictureFormat format, Effort effort) {
    const Image& image = picture(int(state.range(0)));
    const Executor executor(int(state.range(1)));
    std::size_t bytes = 0;
    for (auto _ : state)
        bytes = encode(image, {.format = format, .effort = effort}, {executor}).size();
    report(state, bytes);
}

void png_fast(benchmark::State& state) { run_ours(state, PictureFormat::png, Effort::fast); }
void png_small(benchmark::State& state) { run_ours(state, PictureFormat::png, Effort::small); }
void jpeg_fast(benchmark::State& state) { run_ours(state, PictureFormat::jpeg, Effort::fast); }
void webp_fast(benchmark::State& state) { run_ours(state, PictureFormat::webp, Effort::fast); }
void webp_small(benchmark::State& state) { run_ours(state, PictureFormat::webp, Effort::small); }

void baseline_settings(benchmark::internal::Benchmark* bench) {
    bench->ArgsProduct({{512, 1024, 2048}})
        ->ArgName("size")
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
}

void settings(benchmark::internal::Benchmark* bench) {
    bench->ArgsProduct({{512, 1024, 2048}, {1, 2}})
        ->ArgNames({"size", "threads"})
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
}

BENCHMARK(png_openimageio_default)->Apply(baseline_settings);
BENCHMARK(png_fast)->Apply(settings);
BENCHMARK(png_small)->Apply(settings);
BENCHMARK(jpeg_openimageio)->Apply(baseline_settings);
BENCHMARK(jpeg_fast)->Apply(settings);
BENCHMARK(webp_fast)->Apply(settings);
BENCHMARK(webp_small)->Apply(settings);

}  // namespace
}  // namespace relit::bench
