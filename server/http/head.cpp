#include "server/http/head.h"
#include "server/text.h"

#include <algorithm>

namespace relit::server {
namespace {

Error malformed(const std::string& detail) { return {error_code::malformed_request, detail}; }

bool is_token_char(char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
           std::string_view("!#$%&'*+-.^_`|~").find(c) != std::string_view::npos;
}

bool is_token(std::string_view text) {
    return !text.empty() && std::all_of(text.begin(), text.end(), is_token_char);
}

bool is_control(char c) { return (c >= 0 && c < 0x20) || c == 0x7f; }

std::string lower(std::string_view text) {
    std::string result(text);
    for (char& c : result) c = server::lower(c);
    return result;
}

// Well-formed UTF-8 as Unicode 15, table 3-7: no overlong forms, no surrogates, nothing over
// U+10FFFF.
bool is_utf8(std::string_view text) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    for (std::size_t i = 0; i < text.size();) {
        const unsigned lead = byte(i);
        const int length = lead < 0x80   ? 1
                           : lead < 0xc2 ? 0
                           : lead < 0xe0 ? 2
                           : lead < 0xf0 ? 3
                           : lead < 0xf5 ? 4
                                         : 0;
        if (length == 0 || i + length > text.size()) return false;
        for (int k = 1; k < length; ++k)
            if ((byte(i + k) & 0xc0) != 0x80) return false;
        const unsigned second = length > 1 ? byte(i + 1) : 0;
        if ((lead == 0xe0 && second < 0xa0) || (lead == 0xed && second > 0x9f) ||
            (lead == 0xf0 && second < 0x90) || (lead == 0xf4 && second > 0x8f))
            return false;
        i += std::size_t(length);
    }
    return true;
}

std::string decoded_path(std::string_view raw) {
    for (const std::string_view separator : {"%2f", "%2F", "%5c", "%5C"})
        if (raw.find(separator) != std::string_view::npos)
            throw malformed("The path contains an encoded slash.");
    const auto path = percent_decoded(raw);
    if (!path || !is_utf8(*path) || std::any_of(path->begin(), path->end(), is_control))
        throw malformed("The path is not percent-encoded UTF-8 text.");
    return *path;
}

std::multimap<std::string, std::string> decoded_query(std::string_view raw) {
    std::multimap<std::string, std::string> query;
    while (!raw.empty()) {
        const auto pair = raw.substr(0, raw.find('&'));
        raw.remove_prefix(std::min(raw.size(), pair.size() + 1));
        if (pair.empty()) continue;
        const auto equals = std::min(pair.find('='), pair.size());
        const auto name = percent_decoded(pair.substr(0, equals), true);
        const auto value = percent_decoded(pair.substr(std::min(equals + 1, pair.size())), true);
        if (!name || !value || !is_utf8(*name) || !is_utf8(*value))
            throw malformed("The query is not percent-encoded UTF-8 text.");
        query.emplace(*name, *value);
    }
    return query;
}

// RFC 9112, 3.2: origin form; absolute form has to be understood too; "*" belongs to OPTIONS.
void read_target(std::string_view target, Head& head) {
    if (target == "*" && head.method == "OPTIONS") {
        head.path = "*";
        return;
    }
    if (lower(target.substr(0, 7)) == "http://") {
        const auto slash = target.find('/', 7);
        target = slash == std::string_view::npos ? std::string_view("/") : target.substr(slash);
    }
    if (!target.starts_with('/') || target.find('#') != std::string_view::npos)
        throw malformed("The request's target is not a path.");
    head.target = target;
    const auto question = std::min(target.find('?'), target.size());
    head.path = decoded_path(target.substr(0, question));
    head.query = decoded_query(target.substr(std::min(question + 1, target.size())));
}

// "METHOD target HTTP/1.x" with exactly one space between.
void read_request_line(std::string_view line, const Limits& limits, Head& head) {
    const auto first = line.find(' ');
    const auto last = line.rfind(' ');
    if (first == std::string_view::npos || last == first || line.find(' ', first + 1) != last)
        throw malformed("The request line is not of the form: method, target, version.");
    const auto version = line.substr(last + 1);
    const auto target = line.substr(first + 1, last - first - 1);
    head.method = line.substr(0, first);
    if (!is_token(head.method) || head.method.size() > 32)
        throw malformed("The request's method is not a word.");
    if (target.size() > limits.max_uri_bytes) throw head_too_large(line, limits);
    if (version != "HTTP/1.1" && version != "HTTP/1.0") {
        if (version.starts_with("HTTP/"))
            throw Error(error_code::version_not_supported, "This server speaks HTTP/1.1.");
        throw malformed("The request line does not end in a version of HTTP.");
    }
    head.is_1_1 = version == "HTTP/1.1";
    read_target(target, head);
}

// Headers of which a second one would change what the request is.
bool is_single(std::string_view name) {
    static const Headers names = {
        {"Host", ""},          {"Content-Length", ""},   {"Transfer-Encoding", ""},
        {"Content-Type", ""},  {"Content-Encoding", ""}, {"Expect", ""},
        {"Authorization", ""}, {"Relit-Session", ""},    {"Idempotency-Key", ""}};
    return names.contains(name);
}

void read_header(std::string_view line, Headers& headers) {
    const auto colon = line.find(':');
    if (colon == std::string_view::npos || !is_token(line.substr(0, colon)))
        throw malformed("A header line is not of the form: name, colon, value.");
    const auto name = line.substr(0, colon);
    const auto value = trimmed(line.substr(colon + 1));
    const auto [place, is_new] = headers.emplace(name, value);
    if (is_new) return;
    if (is_single(name)) throw malformed("The header " + place->first + " is there twice.");
    place->second.append(", ").append(value);
}

void read_headers(std::string_view text, const Limits& limits, Headers& headers) {
    int count = 0;
    while (!text.empty()) {
        if (++count > limits.max_headers)
            throw Error(error_code::headers_too_large,
                        "The request has more than max-headers, " +
                            std::to_string(limits.max_headers) + ", headers.",
                        {}, "max-headers");
        const auto end = text.find("\r\n");
        read_header(text.substr(0, end), headers);
        text.remove_prefix(end + 2);
    }
}

std::uint64_t content_length(const std::string& value) {
    const auto length = parse_number<std::uint64_t>(value);
    if (!length || value.size() > 18) throw malformed("The Content-Length is not a number.");
    return *length;
}

// How the body is delimited (RFC 9112, 6.3), and everything about it that is a reason to refuse.
void read_framing(Head& head) {
    const auto value_of = [&](std::string_view name) -> const std::string* {
        const auto found = head.headers.find(name);
        return found == head.headers.end() ? nullptr : &found->second;
    };
    const auto* length = value_of("Content-Length");
    const auto* transfer = value_of("Transfer-Encoding");
    if (length && transfer)
        throw malformed("The request has both a Content-Length and a Transfer-Encoding.");
    if (length) head.content_length = content_length(*length);
    if (transfer) {
        if (lower(*transfer) != "chunked" || !head.is_1_1)
            throw malformed("The only Transfer-Encoding understood is chunked, in HTTP/1.1.");
        head.chunked = true;
    }
    if (const auto* encoding = value_of("Content-Encoding");
        encoding && lower(*encoding) != "identity")
        throw Error(error_code::unsupported_media_type,
                    "Bodies with a Content-Encoding are not accepted.");
    if (!head.may_have_body() && head.has_body())
        throw malformed("A " + head.method + " request has no body here.");
    if (const auto* expect = value_of("Expect")) {
        if (lower(*expect) != "100-continue")
            throw malformed("The only Expect understood is 100-continue.");
        head.expects_continue = head.is_1_1 && head.has_body();
    }
}

bool keeps_alive(const Head& head) {
    const auto found = head.headers.find("Connection");
    if (found == head.headers.end()) return head.is_1_1;
    bool close = false, keep = false;
    std::string_view rest = found->second;
    while (!rest.empty()) {
        const auto comma = std::min(rest.find(','), rest.size());
        const auto token = lower(trimmed(rest.substr(0, comma)));
        close |= token == "close";
        keep |= token == "keep-alive";
        rest.remove_prefix(std::min(comma + 1, rest.size()));
    }
    return !close && (head.is_1_1 || keep);
}

}  // namespace

bool Head::may_have_body() const {
    return method == "POST" || method == "PUT" || method == "PATCH";
}

std::optional<std::string> percent_decoded(std::string_view text, bool plus_is_space) {
    std::string result;
    result.reserve(text.size());
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '%') {
            const int high = i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
            const int low = i + 2 < text.size() ? hex_digit(text[i + 2]) : -1;
            if (high < 0 || low < 0) return std::nullopt;
            result += char(high * 16 + low);
            i += 2;
        } else {
            result += plus_is_space && text[i] == '+' ? ' ' : text[i];
        }
    }
    return result;
}

HeadEnd find_head_end(std::string_view buffer, std::size_t from) {
    for (std::size_t i = from; i < buffer.size(); ++i) {
        const char c = buffer[i];
        if (c == '\n') {
            if (i == 0 || buffer[i - 1] != '\r') return {HeadEnd::malformed, 0};
            if (i >= 3 && buffer[i - 2] == '\n') return {HeadEnd::complete, i + 1};
        } else if ((i > 0 && buffer[i - 1] == '\r') || (is_control(c) && c != '\r' && c != '\t')) {
            return {HeadEnd::malformed, 0};
        }
    }
    return {};
}

Head parse_head(std::string_view text, const Limits& limits) {
    Head head;
    const auto line_end = text.find("\r\n");
    read_request_line(text.substr(0, line_end), limits, head);
    read_headers(text.substr(line_end + 2, text.size() - line_end - 4), limits, head.headers);
    if (head.is_1_1 && !head.headers.contains("Host"))
        throw malformed("The header Host is missing.");
    read_framing(head);
    head.keep_alive = keeps_alive(head);
    return head;
}

Error head_too_large(std::string_view begun, const Limits& limits) {
    const auto line = begun.substr(0, begun.find("\r\n"));
    if (line.size() > limits.max_uri_bytes)
        return {error_code::uri_too_long,
                "The request's target is longer than max-uri-bytes, " +
                    std::to_string(limits.max_uri_bytes) + ".",
                {},
                "max-uri-bytes"};
    return {error_code::headers_too_large,
            "The request's head is longer than max-head-bytes, " +
                std::to_string(limits.max_head_bytes) + ".",
            {},
            "max-head-bytes"};
}

}  // namespace relit::server
