// Bytes of a connection, through the real transport: a server in this process, on a free port.
//
// The first line of an input says how the rest is cut: each of its bytes is the length of a piece,
// which is sent by itself. What is answered must not depend on that.
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "server/routes/meta.h"
#include "tests/fuzz/claims.h"
#include "tests/fuzz/targets.h"
#include "tests/support/http_client.h"
#include "tests/support/test_server.h"

namespace relit::fuzz {
namespace {

using namespace server;

constexpr std::size_t max_cuts = 6;

Reply echo(const Request& request, Services&) {
    std::string body = request.body;
    for (const Part& part : request.parts) body += part.name + ":" + part.content + ";";
    return {.content_type = "text/plain", .body = body};
}

Limits small_limits() {
    Limits limits;  // so that inputs of a few kilobytes reach them
    limits.max_head_bytes = 1000;
    limits.max_uri_bytes = 300;
    limits.max_headers = 12;
    limits.max_parts = 4;
    return limits;
}

int port() {
    static test::TestServer server({{"POST", "/echo", echo, Scope::render, 300, "max-echo"},
                                    {"GET", "/echo/{name}", echo, Scope::read},
                                    {"GET", "/healthz", get_health, Scope::open}},
                                   small_limits());
    return server.port();
}

std::vector<std::string_view> pieces_of(std::string_view cuts, std::string_view bytes) {
    std::vector<std::string_view> pieces;
    for (const char length : cuts.substr(0, max_cuts)) {
        pieces.push_back(bytes.substr(0, static_cast<unsigned char>(length)));
        bytes.remove_prefix(pieces.back().size());
    }
    pieces.push_back(bytes);
    return pieces;
}

// Everything that is answered, without what names time and request.
std::string answers_to(const std::vector<std::string_view>& pieces) {
    test::RawConnection connection(port());
    for (const std::string_view piece : pieces) {
        if (!connection.send(piece)) break;
        if (&piece != &pieces.back()) std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
    connection.finish_sending();
    std::string answers = connection.rest();
    for (const char* name : {"\r\nDate: ", "\r\nX-Request-Id: ", "\r\ntraceresponse: "})
        for (auto at = answers.find(name); at != std::string::npos; at = answers.find(name, at))
            answers.erase(at, answers.find("\r\n", at + 2) - at);
    return answers;
}

}  // namespace

void http(std::string_view input) {
    const auto line = input.substr(0, input.find('\n'));
    if (line.size() == input.size()) return;
    const auto bytes = input.substr(line.size() + 1);
    const std::string answers = answers_to({bytes});
    claim(answers.empty() || answers.starts_with("HTTP/1.1 "), "an answer is HTTP: " + answers);
    claim(answers.find("HTTP/1.1 5") == std::string::npos ||
              answers.find("HTTP/1.1 505 ") != std::string::npos,
          "the client is to blame: " + answers);
    if (line.empty()) return;
    const std::string cut_answers = answers_to(pieces_of(line, bytes));
    claim(answers == cut_answers, "answers do not depend on how bytes arrive:\n" + answers +
                                      "\n--- cut ---\n" + cut_answers);
}

}  // namespace relit::fuzz
