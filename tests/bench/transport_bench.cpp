// Milliseconds per sum of a dipole's profile over a height map, three channels, beside what others do.
// Run: build/bench/tests/bench/relit_bench --benchmark_filter=transport
//
// Marble, 80 mm wide, relief 0.15; terrain, and a dome with an edge of 0.15 around it. Rows are named
// way/map/size/threads. Beside the speed stands the error against the double sum at 300 random
// texels, relative, per cent: RMS and maximum. The direct sum is extrapolated from as many texels, and its time
// is that of one processor; beside the time of every other row stands that of all its processors.
#include <benchmark/benchmark.h>

#include <kissfft/kiss_fft.h>
#include <kissfft/kiss_fftr.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <map>
#include <memory>

#include "core/transport/convolution.h"
#include "core/transport/level_sum.h"
#include "core/transport/texel_tree.h"
#include "core/transport/transport.h"
#include "tests/bench/terrain.h"
#include "tests/support/transport.h"

namespace relit::bench {
namespace {

constexpr int queries = 300;

enum Map { terrain_map, dome_map, flat_map };

// A surface, what enters it, and what is to come out at some texels.
struct Setting {
    std::shared_ptr<TransportSurface> surface;
    std::shared_ptr<RadialKernel> kernel;
    Image flux;
    std::vector<std::pair<int, int>> texels;
    std::vector<float> exact;
    double seconds_directly = 0;  // of all texels: of one processor

    Setting(Map which, int size) {
        const auto dome = [&](int i, int j) {
            const double d = std::hypot(i + 0.5 - size / 2.0, j + 0.5 - size / 2.0) / size;
            return d < 0.3 ? 0.15 + 0.3 * std::sqrt(0.09 - d * d) : 0.0;
        };
        const auto flat = [](int, int) { return 0.5; };
        surface = std::make_shared<TransportSurface>(
            which == terrain_map ? test::surface_of(terrain(size), 0.15)
            : which == dome_map  ? test::surface_of(size, size, dome)
                                 : test::surface_of(size, size, flat));
        flux = test::uneven_flux(*surface);
        kernel =
            std::make_shared<RadialKernel>(test::kernel_for(*surface, test::dipoles("marble", 80)));
        test::Random random(3);
        for (int k = 0; k < queries; ++k)
            texels.emplace_back(int(random() * size), int(random() * size));
        exact.resize(3 * queries);
        const std::clock_t begun = std::clock();
        parallel_rows(test::executor(), queries, {}, [&](RowRange rows) {
            for (int k = rows.begin; k < rows.end; ++k) {
                const auto sums =
                    test::direct_sum(*surface, flux, *kernel, texels[k].first, texels[k].second);
                for (int c = 0; c < 3; ++c) exact[3 * k + c] = float(sums[c]);
            }
        });
        const double taken = double(std::clock() - begun) / CLOCKS_PER_SEC;
        seconds_directly = taken / queries * size * size;
    }
};

const Setting& setting_of(const benchmark::State& state, Map which) {
    static std::map<std::pair<int, int>, std::unique_ptr<Setting>> made;
    std::unique_ptr<Setting>& setting = made[{which, int(state.range(0))}];
    if (!setting) setting = std::make_unique<Setting>(which, int(state.range(0)));
    return *setting;
}

// Of sums without, or with, what a texel's own area adds.
void count_errors(benchmark::State& state, const Setting& setting, const Image& sums,
                  bool has_own) {
    std::vector<float> found;
    for (const auto& [i, j] : setting.texels)
        for (int c = 0; c < 3; ++c) {
            const double own = setting.kernel->at_own_place(c, setting.surface->area.at(i, j));
            found.push_back(sums.at(i, j, c) +
                            (has_own ? 0.0f : float(own) * setting.flux.at(i, j, c)));
        }
    const test::RelativeError error = test::relative_error(found, setting.exact);
    state.counters["rms_%"] = 100 * error.rms;
    state.counters["max_%"] = 100 * error.max;
}

void transport_direct(benchmark::State& state) {
    const Setting& setting = setting_of(state, terrain_map);
    for (auto _ : state) state.SetIterationTime(setting.seconds_directly);
}

template <int thousandths>
void transport_tree(benchmark::State& state) {
    const Setting& setting = setting_of(state, terrain_map);
    const Executor executor(int(state.range(1)));
    const TexelTree tree(*setting.surface, {}, best_simd());
    Image sums;
    for (auto _ : state)
        sums = tree.sum(*setting.kernel, thousandths / 1000.0f, setting.flux, executor, {});
    count_errors(state, setting, sums, false);
    state.counters["MB"] = double(tree.bytes()) / 1e6;
}

template <int ratio>
void transport_levels(benchmark::State& state) {
    const Setting& setting = setting_of(state, terrain_map);
    const Executor executor(int(state.range(1)));
    const LevelSum levels(*setting.surface, *setting.kernel, {ratio}, executor, {}, best_simd());
    Image sums;
    for (auto _ : state) sums = levels.sum(setting.flux, executor, {});
    count_errors(state, setting, sums, false);
    state.counters["MB"] = double(levels.bytes()) / 1e6;
}

// What the renderer calls; all of it, or with all but the light prepared.
template <Map which, TransportAccuracy accuracy, bool is_cold>
void transport_as_chosen(benchmark::State& state) {
    const Setting& setting = setting_of(state, which);
    const Executor executor(int(state.range(1)));
    const auto make = [&] {
        return std::make_unique<Transport>(setting.surface, setting.kernel, accuracy, executor);
    };
    auto transport = make();
    Image sums;
    for (auto _ : state) {
        if (is_cold) transport = make();
        sums = transport->sum(setting.flux, executor);
    }
    count_errors(state, setting, sums, true);
    state.counters["MB"] = double(transport->bytes()) / 1e6;
    state.SetLabel(std::string(name_of(transport->path())));
}

void transport_fft_cold(benchmark::State& state) {
    const Setting& setting = setting_of(state, flat_map);
    const Executor executor(int(state.range(1)));
    const int size = int(state.range(0));
    Image sums;
    for (auto _ : state)
        sums = convolved(KernelSpectrum(*setting.kernel, size, size, executor), setting.flux,
                         executor);
    count_errors(state, setting, sums, false);
}

void transport_fft_warm(benchmark::State& state) {
    const Setting& setting = setting_of(state, flat_map);
    const Executor executor(int(state.range(1)));
    const int size = int(state.range(0));
    const KernelSpectrum spectrum(*setting.kernel, size, size, executor);
    Image sums;
    for (auto _ : state) sums = convolved(spectrum, setting.flux, executor);
    count_errors(state, setting, sums, false);
    state.counters["MB"] = double(spectrum.bytes()) / 1e6;
}

// One forward and one inverse real transform of one channel of the padded size, by kissfft's own
// real transforms along rows and in columns laid side by side; one thread.
void transport_fft_unit(benchmark::State& state) {
    const Setting& setting = setting_of(state, flat_map);
    const int size = int(state.range(0));
    const KernelSpectrum spectrum(*setting.kernel, size, size, test::executor());
    const int width = spectrum.padded_width(), height = spectrum.padded_height();
    const int columns = width / 2 + 1;
    const auto along = kiss_fftr_alloc(width, 0, nullptr, nullptr);
    const auto along_back = kiss_fftr_alloc(width, 1, nullptr, nullptr);
    const auto down = kiss_fft_alloc(height, 0, nullptr, nullptr);
    const auto down_back = kiss_fft_alloc(height, 1, nullptr, nullptr);
    constexpr int block = 8;
    std::vector<float> numbers(std::size_t(width) * height, 1.0f);
    std::vector<kiss_fft_cpx> spectra(std::size_t(columns) * height), rows(block * columns);
    std::vector<kiss_fft_cpx> column(height);
    for (auto _ : state) {
        for (int j = 0; j < height; j += block) {
            const int count = std::min(block, height - j);
            for (int k = 0; k < count; ++k)
                kiss_fftr(along, &numbers[std::size_t(j + k) * width], &rows[k * columns]);
            for (int i = 0; i < columns; ++i)
                for (int k = 0; k < count; ++k)
                    spectra[std::size_t(i) * height + j + k] = rows[k * columns + i];
        }
        for (int i = 0; i < columns; ++i) {
            kiss_fft(down, &spectra[std::size_t(i) * height], column.data());
            kiss_fft(down_back, column.data(), &spectra[std::size_t(i) * height]);
        }
        for (int j = 0; j < height; j += block) {
            const int count = std::min(block, height - j);
            for (int i = 0; i < columns; ++i)
                for (int k = 0; k < count; ++k)
                    rows[k * columns + i] = spectra[std::size_t(i) * height + j + k];
            for (int k = 0; k < count; ++k)
                kiss_fftri(along_back, &rows[k * columns], &numbers[std::size_t(j + k) * width]);
        }
        for (float& number : numbers) number /= float(width) * float(height);
    }
    for (void* state_of : {static_cast<void*>(along), static_cast<void*>(along_back),
                           static_cast<void*>(down), static_cast<void*>(down_back)})
        kiss_fft_free(state_of);
}

void settings(benchmark::internal::Benchmark* bench) {
    bench->ArgsProduct({{512, 1024}, {1, 2}})
        ->ArgNames({"size", "threads"})
        ->Unit(benchmark::kMillisecond)
        ->MeasureProcessCPUTime()
        ->UseRealTime();
}

BENCHMARK(transport_direct)
    ->ArgsProduct({{512, 1024}, {1}})
    ->ArgNames({"size", "threads"})
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1)
    ->UseManualTime();
BENCHMARK(transport_tree<100>)->Apply(settings);
BENCHMARK(transport_tree<50>)->Apply(settings);
BENCHMARK(transport_tree<20>)->Apply(settings);
BENCHMARK(transport_levels<3>)->Apply(settings);
BENCHMARK(transport_levels<4>)->Apply(settings);
BENCHMARK(transport_levels<6>)->Apply(settings);
BENCHMARK(transport_as_chosen<terrain_map, TransportAccuracy::preview, false>)->Apply(settings);
BENCHMARK(transport_as_chosen<terrain_map, TransportAccuracy::preview, true>)->Apply(settings);
BENCHMARK(transport_as_chosen<terrain_map, TransportAccuracy::final, false>)->Apply(settings);
BENCHMARK(transport_as_chosen<terrain_map, TransportAccuracy::final, true>)->Apply(settings);
BENCHMARK(transport_as_chosen<dome_map, TransportAccuracy::preview, false>)->Apply(settings);
BENCHMARK(transport_as_chosen<dome_map, TransportAccuracy::final, false>)->Apply(settings);
BENCHMARK(transport_fft_unit)->Apply(settings);
BENCHMARK(transport_fft_warm)->Apply(settings);
BENCHMARK(transport_fft_cold)->Apply(settings);

}  // namespace
}  // namespace relit::bench
