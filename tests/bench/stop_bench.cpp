// What a frame that nobody wants any more still costs: processor time of the whole program from the stop
// on, threads that look for work before they sleep included.
//
//     build/bench/tests/bench/relit_stop_bench
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "core/io/encode.h"
#include "core/render/render.h"
#include "tests/bench/terrain.h"

namespace relit::bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::duration<double, std::milli>;

double processor_ms() {
    timespec time{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return double(time.tv_sec) * 1e3 + double(time.tv_nsec) * 1e-6;
}

void write_picture(const Scene& scene, const RenderControl& control) {
    const Rendering rendering(scene, {}, control);
    const PictureFacts& facts = rendering.facts();
    (void)encode({facts.width, facts.height, facts.channels,
                  [&](RowRange rows) { return rendering.rows(rows); }},
                 {.format = PictureFormat::jpeg}, {control.executor, control.stop});
}

// Processor time after a stop at `share` of the picture's time, and how long it took to return.
struct Stopped {
    double processor_ms, wall_ms;
};
Stopped stopped_at(const Scene& scene, const Executor& executor, SharedCache& cache,
                   Milliseconds after) {
    std::stop_source stop;
    std::atomic<double> returned = 0;
    std::thread client([&] {
        try {
            write_picture(scene, {.executor = executor, .stop = stop.get_token(), .cache = &cache});
        } catch (const Error&) {
        }
        returned = Milliseconds(Clock::now().time_since_epoch()).count();
    });
    std::this_thread::sleep_for(after);
    const double before = processor_ms();
    const double at = Milliseconds(Clock::now().time_since_epoch()).count();
    stop.request_stop();
    client.join();
    std::this_thread::sleep_for(20ms);
    return {processor_ms() - before, returned - at};
}

void measure(int size, double elevation) {
    const Executor executor(2);
    SharedCache cache(std::uint64_t(1) << 32);
    HeightField field = terrain(size);
    field.key = field.shape_key = "terrain";
    Scene scene;
    scene.field = std::make_shared<const HeightField>(std::move(field));
    scene.relief = 0.1;
    scene.material.depth = 0.004;
    scene.lights = {DirectionalLight{.azimuth_deg = 300, .elevation_deg = elevation}};
    write_picture(scene, {.executor = executor, .cache = &cache});
    const auto begin = Clock::now();
    write_picture(scene, {.executor = executor, .cache = &cache});
    const Milliseconds whole = Clock::now() - begin;
    std::vector<double> processor, wall;
    for (int k = 0; k < 40; ++k) {
        const Stopped stopped = stopped_at(scene, executor, cache, whole * (0.1 + 0.8 * k / 40));
        processor.push_back(stopped.processor_ms);
        wall.push_back(stopped.wall_ms);
    }
    std::sort(processor.begin(), processor.end());
    std::sort(wall.begin(), wall.end());
    std::printf(
        "%d x %d at %g degrees, %.0f ms a picture: after the stop %.2f ms of processor time in the "
        "median, %.2f in nine of ten; back after %.2f and %.2f ms\n",
        size, size, elevation, whole.count(), processor[20], processor[36], wall[20], wall[36]);
    std::fflush(stdout);
}

}  // namespace
}  // namespace relit::bench

int main() {
    relit::bench::measure(1024, 30);
    relit::bench::measure(2048, 30);
    relit::bench::measure(2048, 8);
    relit::bench::measure(4096, 8);
}
