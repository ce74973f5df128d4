// What batches cost beside bare rendering, and requests beside batches: frames a second of a 512 x 512
// orbit, rendered and written alone and as a batch; of a drag, alone and while a batch runs.
//
//     build/bench/tests/bench/relit_batch_bench [frames of the batch]
#include <atomic>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <thread>

#include "server/samples/samples.h"
#include "server/scenes/picture_file.h"
#include "server/scenes/scene_loading.h"
#include "server/schema/scene_json.h"
#include "tests/support/http_client.h"
#include "tests/support/relit_process.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

const server::Sample& relief() { return server::samples().front(); }

Json orbit_scene(double azimuth) {
    return {{"height", {{"image", relief().id}}},
            {"light", {{"type", "directional"}, {"azimuth", azimuth}, {"elevation", 30}}}};
}

// Frames a second without a server: `renders` side by side, each on `threads`.
double bare_rate(int renders, int threads, std::chrono::seconds time) {
    std::atomic<int> frames{0};
    const auto begin = Clock::now();
    std::vector<std::thread> workers;
    for (int w = 0; w < renders; ++w)
        workers.emplace_back([&] {
            const Executor executor(threads);
            SharedCache cache(64 << 20);
            const auto find = [](const server::ImageSource&) {
                return server::SharedBytes{nullptr, relief().bytes};
            };
            while (Clock::now() - begin < time) {
                const auto scene = server::parse_scene(orbit_scene(frames * 0.18).dump(), 1);
                const auto text = server::scene_json(scene);
                const Scene loaded = server::load_scene(
                    scene, find, [](std::string_view bytes) { return decode(bytes); }, {}, executor,
                    cache);
                (void)server::picture_file(loaded, scene, text,
                                           {.executor = executor, .cache = &cache});
                ++frames;
            }
        });
    for (std::thread& worker : workers) worker.join();
    return frames / seconds_since(begin);
}

std::string submit_orbit(int port, int frames) {
    const Json body = {{"scene", {{"height", {{"image", relief().id}}}}},
                       {"sweep", {{"path", "orbit"}, {"count", frames}, {"elevation", 30}}}};
    const HttpReply reply = http(port, "POST", "/v1/batches", body.dump());
    if (reply.status != 202) throw std::runtime_error(reply.body);
    return Json::parse(reply.body)["id"];
}

Json batch_at(int port, const std::string& id) {
    return Json::parse(http(port, "GET", "/v1/batches/" + id).body);
}

double batch_rate(int port, int frames) {
    const auto begin = Clock::now();
    const std::string id = submit_orbit(port, frames);
    while (batch_at(port, id)["status"] != "done") std::this_thread::sleep_for(50ms);
    return frames / seconds_since(begin);
}

// One client that drags: the next frame is asked for when the last one is there.
double drag_rate(int port, std::chrono::seconds time) {
    RawConnection connection(port);
    const auto begin = Clock::now();
    int frames = 0;
    for (; Clock::now() - begin < time; ++frames) {
        Json scene = orbit_scene(frames * 2);
        scene["output"] = {{"format", "jpeg"}};
        connection.send(
            http_request("POST", "/v1/render", scene.dump(), {{"Relit-Session", "drag"}}));
        const HttpReply reply = connection.receive();
        if (reply.status != 200) throw std::runtime_error(reply.body);
    }
    return frames / seconds_since(begin);
}

void measure(int frames) {
    const int threads = Executor().threads();
    for (int round = 0; round < 3; ++round) {
        const double together = bare_rate(1, threads, 5s);
        const double side_by_side = bare_rate(threads, 1, 5s);
        RelitProcess relitd({.flags = {"--log-level=warn"}});
        const double batch = batch_rate(relitd.port(), frames);
        const double drag = drag_rate(relitd.port(), 5s);
        const std::string id = submit_orbit(relitd.port(), 10'000);
        std::this_thread::sleep_for(500ms);
        const int before = batch_at(relitd.port(), id)["done"];
        const double drag_beside = drag_rate(relitd.port(), 5s);
        const double batch_beside = (batch_at(relitd.port(), id)["done"].get<int>() - before) / 5.0;
        std::printf(
            "frames/s: bare %.1f (one at a time), %.1f (side by side); batch %.1f = %.0f %% of the "
            "better; drag %.1f alone, %.1f beside a batch = %.0f %%, which goes on at %.1f\n",
            together, side_by_side, batch, 100 * batch / std::max(together, side_by_side), drag,
            drag_beside, 100 * drag_beside / drag, batch_beside);
        std::fflush(stdout);
    }
}

}  // namespace
}  // namespace relit::test

int main(int argc, char** argv) { relit::test::measure(argc > 1 ? std::stoi(argv[1]) : 2000); }
