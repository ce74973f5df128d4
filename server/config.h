// The settings of relitd: from flags, then from environment variables, else their defaults; nothing
// hidden, and nothing unknown accepted.
#pragma once

#include <chrono>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/simd.h"
#include "server/http/cors.h"
#include "server/limits.h"
#include "server/logging/log.h"

namespace relit::server {

struct Config {
    std::string host = "127.0.0.1";
    int port = 8080;  ///< 0: any free one
    std::filesystem::path data_dir;
    int threads = 0;  ///< 0: one per processor
    Simd simd = best_simd();
    std::string log_level = "info";
    LogFormat log_format = LogFormat::text;
    std::chrono::milliseconds log_slow{0};  ///< requests that take longer are warned of; 0: none
    CorsPolicy cors;
    std::filesystem::path api_keys;  ///< the file of keys; empty: none are asked for
    bool insecure = false;           ///< listen to other machines though no keys are asked for
    Limits limits;

    std::vector<std::pair<std::string, std::string>>
        settings;  ///< every flag and its value, for the log
};

/// What to do after reading the settings: run, or exit with a status because everything has been
/// said.
struct ConfigOrExit {
    Config config;
    std::optional<int> exit_status;  ///< 0 after --help and --version, 2 for what is not understood
};

/// Reads the settings.
///
/// @param environment  "NAME=value" as in `environ`, ended by a null pointer. Every RELIT_ variable
///                     has to be a setting's or one of the few that are for others (RELIT_DATA:
///                     data of the tests; RELIT_HTTPLIB_DIR: the build; RELIT_API_KEY: clients)
/// @param out, err     take what --help and refusals have to say
[[nodiscard]] ConfigOrExit read_config(int argc, const char* const* argv,
                                       const char* const* environment, std::ostream& out,
                                       std::ostream& err);

/// How many renders run at once: max_renders, or one for every two threads (more only make each
/// later).
/// @throws std::runtime_error with a sentence for the operator: more than there are threads. Those
///         beyond would hold their slots while they wait for a thread, where no stop reaches them.
[[nodiscard]] int renders_at_once(const Config& config, int threads);

/// Whether there is a thread for each of max_batch_renders.
/// @throws std::runtime_error with a sentence for the operator
void check_batch_renders(const Limits& limits, int threads);

/// Whether what may reach the server has to bring a key: other machines do, unless they are let in
/// expressly.
/// @return a warning for the log, where they are let in
/// @throws std::runtime_error with a sentence for the operator
std::string check_who_may_reach_it(const Config& config);

/// Whether streams leave connections for other requests.
/// @throws std::runtime_error with a sentence for the operator
void check_streams(const Limits& limits);

}  // namespace relit::server
