// HTTP from the client's side, over a plain socket: whole requests for the ordinary tests, single
// bytes for the nasty ones. Understands replies with a Content-Length and those in chunks.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relit::test {

struct HttpReply {
    int status = 0;
    std::multimap<std::string, std::string> headers;  ///< names in lower case
    std::string body;

    /// Empty where there is none.
    [[nodiscard]] std::string header(const std::string& lower_case_name) const;
};

/// A new connection to 127.0.0.1, without delay for small pieces. @throws std::runtime_error
[[nodiscard]] int connected_socket(int port);

/// A connection to 127.0.0.1. Every wait ends after 10 s in a std::runtime_error.
class RawConnection {
public:
    explicit RawConnection(int port);
    ~RawConnection();
    RawConnection(const RawConnection&) = delete;
    RawConnection& operator=(const RawConnection&) = delete;

    /// Sends all of it. @return false when the server has closed meanwhile
    bool send(std::string_view bytes);

    /// Says that nothing more will be sent; replies may still be received.
    void finish_sending();

    /// The next reply, interim ones (100) included. @param to_head  of a HEAD request: no body
    /// follows
    [[nodiscard]] HttpReply receive(bool to_head = false);

    /// The head of the next reply alone; next_chunk() has the rest.
    [[nodiscard]] HttpReply receive_head();

    /// The next chunk of a reply in chunks; nothing at its end. @throws std::runtime_error where the
    /// connection ends before
    [[nodiscard]] std::optional<std::string> next_chunk();

    /// Everything until the server ends the connection.
    [[nodiscard]] std::string rest();

    /// Whether the server ends the connection within `patience`, without another byte.
    [[nodiscard]] bool ends_within(std::chrono::milliseconds patience);

    /// Whether anything arrives within `patience`.
    [[nodiscard]] bool hears_within(std::chrono::milliseconds patience);

    void close();

private:
    bool receive_more();
    std::string receive_bytes(std::size_t size);
    int socket_ = -1;
    std::string buffer_;
};

using HttpHeaders = std::vector<std::pair<std::string, std::string>>;

/// The text of a request: with Host, and with Content-Length where there is a body or the method
/// takes one.
[[nodiscard]] std::string http_request(const std::string& method, const std::string& target,
                                       std::string_view body = {}, const HttpHeaders& headers = {});

/// One request on a connection of its own.
[[nodiscard]] HttpReply http(int port, const std::string& method, const std::string& target,
                             std::string_view body = {}, const HttpHeaders& headers = {});

/// A multipart/form-data body of files, and its Content-Type.
struct FormFile {
    std::string name;
    std::string filename;
    std::string content;
};
[[nodiscard]] std::pair<std::string, std::string> form_of(const std::vector<FormFile>& files);

}  // namespace relit::test
