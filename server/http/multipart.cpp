#include "server/http/multipart.h"

#include <algorithm>
#include <optional>

#include "server/error_codes.h"
#include "server/text.h"

namespace relit::server {
namespace {

Error malformed(const std::string& detail) {
    return {error_code::malformed_request, "The multipart/form-data body " + detail};
}

bool equal_ignoring_case(std::string_view a, std::string_view b) {
    const HeaderLess less;
    return !less(a, b) && !less(b, a);
}

// A token, or a quoted string with backslashes before quotes and backslashes; leaves `rest` behind
// it.
std::string take_value(std::string_view& rest) {
    std::string value;
    if (!rest.starts_with('"')) {
        value = trimmed(rest.substr(0, rest.find(';')));
        rest.remove_prefix(std::min(rest.find(';'), rest.size()));
        return value;
    }
    std::size_t i = 1;
    for (; i < rest.size() && rest[i] != '"'; ++i) {
        if (rest[i] == '\\' && i + 1 < rest.size() && (rest[i + 1] == '"' || rest[i + 1] == '\\'))
            ++i;
        value += rest[i];
    }
    rest.remove_prefix(std::min(i + 1, rest.size()));
    return value;
}

// The value of a parameter of `first; name=value; name="value"`.
std::optional<std::string> parameter(std::string_view header, std::string_view name) {
    std::string_view rest = header.substr(std::min(header.find(';'), header.size()));
    while (rest.starts_with(';')) {
        rest.remove_prefix(1);
        const auto equals = rest.find('=');
        if (equals == std::string_view::npos) return std::nullopt;
        const auto key = trimmed(rest.substr(0, equals));
        rest.remove_prefix(equals + 1);
        rest.remove_prefix(std::min(rest.find_first_not_of(" \t"), rest.size()));
        const auto value = take_value(rest);
        if (equal_ignoring_case(key, name)) return value;
        rest.remove_prefix(std::min(rest.find(';'), rest.size()));
    }
    return std::nullopt;
}

// Where a part lies in the body, with its head already read.
struct FoundPart {
    Part part;
    std::size_t begin = 0;
    std::size_t end = 0;
};

void read_part_header(std::string_view line, Part& part) {
    const auto colon = line.find(':');
    if (colon == std::string_view::npos) throw malformed("has a part with a broken header.");
    const auto name = line.substr(0, colon);
    const auto value = trimmed(line.substr(colon + 1));
    if (equal_ignoring_case(name, "Content-Type")) part.content_type = value;
    if (!equal_ignoring_case(name, "Content-Disposition")) return;
    const auto part_name = parameter(value, "name");
    if (!equal_ignoring_case(trimmed(value.substr(0, value.find(';'))), "form-data") || !part_name)
        throw malformed("has a part without a name.");
    part.name = *part_name;
    part.filename = parameter(value, "filename").value_or("");
}

// Reads the head at `position`; returns where the content begins.
std::size_t read_part_head(std::string_view body, std::size_t position, const Limits& limits,
                           Part& part) {
    const std::size_t limit = position + limits.max_part_head_bytes;
    for (;;) {
        const auto end = body.substr(0, std::min(limit, body.size())).find("\r\n", position);
        if (end == std::string_view::npos && limit < body.size())
            throw Error(error_code::body_too_large,
                        "The form has a part whose head is longer than max-part-head-bytes, " +
                            std::to_string(limits.max_part_head_bytes) + ".",
                        {}, "max-part-head-bytes");
        if (end == std::string_view::npos) throw malformed("has a part whose head does not end.");
        if (end == position) break;
        read_part_header(body.substr(position, end - position), part);
        position = end + 2;
    }
    if (part.name.empty()) throw malformed("has a part without a name.");
    return position + 2;
}

std::vector<FoundPart> find_parts(std::string_view body, const std::string& boundary,
                                  const Limits& limits) {
    const std::string first = "--" + boundary;
    const std::string next = "\r\n" + first;
    auto position = body.starts_with(first) ? 0 : body.find(next);
    if (position == std::string_view::npos) throw malformed("does not contain its boundary.");
    position += position == 0 ? first.size() : next.size();

    std::vector<FoundPart> spans;
    while (!body.substr(position).starts_with("--")) {
        if (!body.substr(position).starts_with("\r\n")) throw malformed("has a broken boundary.");
        if (int(spans.size()) == limits.max_parts)
            throw Error(error_code::body_too_large,
                        "The form has more than max-parts, " + std::to_string(limits.max_parts) +
                            ", parts.",
                        {}, "max-parts");
        FoundPart span;
        // The CRLF before the next boundary is the boundary's; an empty part shares it with its
        // head.
        span.begin = read_part_head(body, position + 2, limits, span.part);
        span.end = body.find(next, span.begin - 2);
        if (span.end == std::string_view::npos) throw malformed("ends within a part.");
        position = span.end + next.size();
        span.end = std::max(span.end, span.begin);
        spans.push_back(std::move(span));
    }
    return spans;
}

}  // namespace

bool is_multipart(std::string_view content_type) {
    return equal_ignoring_case(trimmed(content_type.substr(0, content_type.find(';'))),
                               "multipart/form-data");
}

std::vector<Part> parse_multipart(std::string body, std::string_view content_type,
                                  const Limits& limits) {
    const auto boundary = parameter(content_type, "boundary");
    if (!boundary || boundary->empty() || boundary->size() > 70)  // RFC 2046, 5.1.1
        throw malformed("needs a boundary of 1 to 70 characters in its Content-Type.");
    auto spans = find_parts(body, *boundary, limits);
    const auto largest = std::max_element(
        spans.begin(), spans.end(),
        [](const FoundPart& a, const FoundPart& b) { return a.end - a.begin < b.end - b.begin; });
    for (auto span = spans.begin(); span != spans.end(); ++span)
        if (span != largest) span->part.content = body.substr(span->begin, span->end - span->begin);
    if (largest != spans.end()) {
        body.resize(largest->end);
        body.erase(0, largest->begin);
        largest->part.content = std::move(body);
    }
    std::vector<Part> parts;
    parts.reserve(spans.size());
    for (FoundPart& span : spans) parts.push_back(std::move(span.part));
    return parts;
}

}  // namespace relit::server
