// Images decoded in processes of their own, so that what a file does to its decoder (a crash, a
// bomb, an endless loop, an exploit) costs that process and one refusal. For everything in relitd
// that decodes bytes from outside.
//
// The server starts a helper (decode_helper.h), which forks the processes ahead of time. An
// image goes there as an anonymous file; its texels come back as another, into which they are decoded,
// and are copied from there: what is mapped could be changed or cut off under the server's hands.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "server/decoding/image_decoder.h"
#include "server/decoding/messages.h"
#include "server/jobs/render_slots.h"
#include "server/metrics.h"
#include "server/storage/files.h"

namespace relit::server {

struct DecodePoolSettings {
    int workers = 2;                            ///< images decoded at once, > 0; more wait
    std::chrono::milliseconds timeout{30'000};  ///< decode-timeout: for one image
    std::uint64_t memory_bytes = 1536u << 20;   ///< max-decode-memory: of one process
    DecodeLimits limits{};
    std::string program = "/proc/self/exe";  ///< relitd
};

/// Safe from any thread.
class DecodePool {
public:
    /// Starts the helper and as many processes as there are workers; does not wait for them.
    DecodePool(DecodePoolSettings settings, Metrics& metrics);
    ~DecodePool();  ///< ends them all; nobody may be waiting for an image
    DecodePool(const DecodePool&) = delete;
    DecodePool& operator=(const DecodePool&) = delete;

    /// @throws Error as ImageDecoder says; image_broken where the process ended without an answer,
    ///         too_costly where it took too long or too much, not_ready where none can be started
    [[nodiscard]] DecodedImage decode(std::string_view bytes, const DecodeControl& control);
    [[nodiscard]] ImageInfo check(std::string_view bytes, const DecodeControl& control);

    /// Both, for those that need not know where they decode.
    [[nodiscard]] ImageDecoder decoder();

private:
    struct Process {
        std::uint64_t number = 0;
        std::unique_ptr<File> socket;
        int images = 0;  // that it has decoded
    };

    [[nodiscard]] ImageInfo decode_to(std::string_view bytes, const DecodeControl& control,
                                      int texels);
    [[nodiscard]] ImageInfo in_a_process(std::string_view bytes, const DecodeControl& control,
                                         int texels);
    [[nodiscard]] Process take_process();
    void put_back(Process process);
    void replace(const Process& process);
    void tell_of_confinement();

    // With mutex_ locked:
    [[nodiscard]] Process new_process();
    bool order(const HelperOrder& order, int socket = -1);
    void start_helper();
    void end_helper();

    const DecodePoolSettings settings_;
    const DecodeAllowance allowance_;
    Metrics& metrics_;
    RenderSlots slots_;
    std::mutex mutex_;
    std::list<Process> ready_;      // last used first
    std::unique_ptr<File> helper_;  // its socket
    pid_t helper_pid_ = -1;
    std::uint64_t last_number_ = 0;
    bool told_of_confinement_ = false;
};

}  // namespace relit::server
