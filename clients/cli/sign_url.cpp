// relit sign-url: a URL of a server that is good for a while without a key.
#include <chrono>
#include <cstdlib>

#include "clients/cli/commands.h"
#include "clients/cli/failure.h"
#include "server/access/signed_url.h"

namespace relit::cli {
namespace {

std::string api_key() {
    const char* key = std::getenv("RELIT_API_KEY");
    if (!key || !*key)
        throw Failure(Exit::usage, "the key to sign with has to be in RELIT_API_KEY");
    return key;
}

// Where the path begins of "https://host:8080/v1/…", or of a path alone.
std::size_t path_of(const std::string& url) {
    const auto scheme = url.find("://");
    const auto path = url.find('/', scheme == std::string::npos ? 0 : scheme + 3);
    const bool is_url = url.starts_with("http://") || url.starts_with("https://");
    if (path == std::string::npos || (path > 0 && !is_url))
        throw Failure(Exit::usage, "'" + url + "' is no http:// or https:// URL with a path");
    return path;
}

void check(const std::string& url) {
    for (const char c : url)
        if (c <= ' ' || c >= 0x7f || c == '#')
            throw Failure(Exit::usage, "'" + url +
                                           "' has spaces, a fragment or characters that are not "
                                           "percent-encoded");
    for (const char* name : {"?expires=", "&expires=", "?signature=", "&signature="})
        if (url.find(name) != std::string::npos)
            throw Failure(Exit::usage, "'" + url + "' is signed already");
}

}  // namespace

void sign_url_command(const Options& options) {
    using namespace std::chrono;
    const std::string key = api_key();
    check(options.url);
    const std::size_t path = path_of(options.url);
    const auto expires = floor<seconds>(system_clock::now()) + seconds(options.valid_s);
    write_to_stdout(options.url.substr(0, path) +
                    server::signed_target(key, std::string_view(options.url).substr(path),
                                          expires.time_since_epoch().count()) +
                    "\n");
}

}  // namespace relit::cli
