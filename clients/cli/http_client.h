// HTTP and HTTPS to one server, certificates verified, with the key that RELIT_API_KEY holds; the only include of httplib.h in the
// clients is in its .cpp.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace relit::cli {

struct HttpReply {
    int status = 0;
    std::string body;
    std::string content_type;
    std::string etag;         ///< empty where there is none
    std::string retry_after;  ///< as it was sent; empty where there is none
};

class HttpClient {
public:
    /// @param url  http or https, host, maybe a port and a path that goes before every other
    /// @throws Failure usage when it is something else
    explicit HttpClient(const std::string& url);
    ~HttpClient();

    // Paths begin with '/'. @throws Failure unreachable when no answer comes
    [[nodiscard]] HttpReply head(const std::string& path);
    [[nodiscard]] HttpReply get(const std::string& path);
    [[nodiscard]] HttpReply remove(const std::string& path);  ///< DELETE
    /// @param sent             told the share of the body that is sent
    /// @param idempotency_key  makes it safe to repeat; empty: none
    [[nodiscard]] HttpReply post(const std::string& path, std::string_view body,
                                 const std::string& content_type,
                                 const std::function<void(double)>& sent = {},
                                 const std::string& idempotency_key = "");

private:
    struct Connection;
    std::unique_ptr<Connection> connection_;
};

}  // namespace relit::cli
