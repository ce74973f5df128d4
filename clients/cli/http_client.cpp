#include "clients/cli/http_client.h"

#define CPPHTTPLIB_OPENSSL_SUPPORT
#include <httplib.h>

#include <cstdlib>

#include "clients/cli/failure.h"

namespace relit::cli {
namespace {

using namespace std::chrono_literals;

constexpr auto connect_patience = 10s;
constexpr auto answer_patience = 15min;  // a server's queue and render may take theirs

struct Url {
    std::string origin;  // "http://host:port"
    std::string folder;  // "" or "/some/where"
};

Url parsed(const std::string& url) {
    const bool known = url.starts_with("http://") || url.starts_with("https://");
    const auto host = url.find("://") + 3;
    if (!known || url.find_first_of("@?# \t") != std::string::npos || host == url.size() ||
        url[host] == '/')
        throw Failure(Exit::usage,
                      "--server: '" + url + "' is not http://host:port or https://host");
    const auto slash = url.find('/', host);
    if (slash == std::string::npos) return {url, ""};
    const auto end = url.find_last_not_of('/');
    return {url.substr(0, slash), end < slash ? "" : url.substr(slash, end + 1 - slash)};
}

std::string words_of(httplib::Error error) {
    switch (error) {
        case httplib::Error::SSLConnection:
            return "no TLS connection";
        case httplib::Error::SSLLoadingCerts:
            return "this machine has no trusted certificates to check it by";
        case httplib::Error::SSLServerVerification:
        case httplib::Error::SSLServerHostnameVerification:
            return "its certificate is not trusted";
        default:
            return part_of_line(httplib::to_string(error));
    }
}

}  // namespace

struct HttpClient::Connection {
    explicit Connection(const Url& url)
        : origin(url.origin), folder(url.folder), client(url.origin) {}
    std::string origin;
    std::string folder;
    httplib::Client client;

    [[nodiscard]] HttpReply reply(httplib::Result result) const {
        if (!result)
            throw Failure(Exit::unreachable,
                          origin + ": cannot be reached: " + words_of(result.error()));
        return {result->status, std::move(result->body), result->get_header_value("Content-Type"),
                result->get_header_value("ETag"), result->get_header_value("Retry-After")};
    }
};

HttpClient::HttpClient(const std::string& url)
    : connection_(std::make_unique<Connection>(parsed(url))) {
    httplib::Client& client = connection_->client;
    if (!client.is_valid()) throw Failure(Exit::usage, "--server: '" + url + "' is no address");
    client.set_keep_alive(true);
    client.set_tcp_nodelay(true);
    client.set_connection_timeout(connect_patience);
    client.set_read_timeout(answer_patience);
    client.set_write_timeout(60s);
    if (const char* key = std::getenv("RELIT_API_KEY"); key && *key)
        client.set_bearer_token_auth(key);
    client.set_payload_max_length(std::size_t(8) << 30);  // the largest picture of floats
}

HttpClient::~HttpClient() = default;

HttpReply HttpClient::head(const std::string& path) {
    return connection_->reply(connection_->client.Head(connection_->folder + path));
}

HttpReply HttpClient::get(const std::string& path) {
    return connection_->reply(connection_->client.Get(connection_->folder + path));
}

HttpReply HttpClient::remove(const std::string& path) {
    return connection_->reply(connection_->client.Delete(connection_->folder + path));
}

HttpReply HttpClient::post(const std::string& path, std::string_view body,
                           const std::string& content_type, const std::function<void(double)>& sent,
                           const std::string& idempotency_key) {
    const auto progress = [&](std::size_t done, std::size_t all) {
        if (sent && all > 0) sent(double(done) / double(all));
        return true;
    };
    httplib::Headers headers;
    if (!idempotency_key.empty()) headers.emplace("Idempotency-Key", idempotency_key);
    return connection_->reply(connection_->client.Post(
        connection_->folder + path, headers, body.data(), body.size(), content_type, progress));
}

}  // namespace relit::cli
