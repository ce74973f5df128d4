// The transport in the test's own process, on a free port, with routes and limits of the test's
// choice.
#pragma once

#include <spdlog/spdlog.h>

#include <thread>
#include <utility>
#include <vector>

#include "server/http/server.h"
#include "server/services.h"
#include "tests/support/temporary_folder.h"

namespace relit::test {

/// Decodes in the test's own process.
inline server::ImageDecoder decoder_here(const DecodeLimits& limits) {
    return {[limits](std::string_view bytes, const server::DecodeControl&) {
                return decode(bytes, limits);
            },
            [limits](std::string_view bytes, const server::DecodeControl&) {
                return decode(bytes, limits).info;
            }};
}

/// Everything a handler needs, small, with an empty store.
struct TestServices {
    explicit TestServices(server::Limits its_limits = {},
                          std::vector<server::BuiltIn> built_in = {})
        : limits(its_limits),
          images(folder.path() / "data",
                 {.read_info = [this](std::string_view bytes) { return decoder.check(bytes, {}); },
                  .max_bytes = limits.max_storage_bytes,
                  .built_in = std::move(built_in)}) {
        spdlog::set_level(spdlog::level::off);
    }

    TemporaryFolder folder;
    server::Limits limits;
    server::ImageDecoder decoder = decoder_here(server::decode_limits(limits));
    server::ImageStore images;
    server::RenderSlots renders{{.max_running = 1, .max_waiting = limits.max_queue}};
    server::RenderSlots decodes{{.max_running = 1, .max_waiting = limits.max_queue}};
    Executor executor{1};
    SharedCache cache{limits.max_cache_bytes};
    server::Metrics metrics;
    server::Batches batches{folder.path() / "data" / "batches",
                            {.images = images,
                             .decoder = decoder,
                             .cache = cache,
                             .renders = renders,
                             .metrics = metrics,
                             .limits = limits}};  // at rest until a test starts them
    server::Services services{images,
                              renders,
                              batches,
                              decodes,
                              executor,
                              cache,
                              metrics,
                              limits,
                              decoder,
                              {},
                              folder.path() / "data"};
};

class TestServer {
public:
    explicit TestServer(std::vector<server::Route> routes, server::Limits limits = {})
        : services_(limits),
          router_(std::move(routes)),
          server_(router_, services_.services, services_.limits),
          port_(server_.bind("127.0.0.1", 0)),
          serving_([this] { server_.serve(); }) {}

    ~TestServer() {
        server_.stop();
        server_.cut();
        if (serving_.joinable()) serving_.join();
    }
    TestServer(const TestServer&) = delete;
    TestServer& operator=(const TestServer&) = delete;

    [[nodiscard]] int port() const { return port_; }
    [[nodiscard]] server::Server& server() { return server_; }
    [[nodiscard]] TestServices& services() { return services_; }
    void join() { serving_.join(); }

private:
    TestServices services_;
    server::Router router_;
    server::Server server_;
    int port_;
    std::thread serving_;
};

}  // namespace relit::test
