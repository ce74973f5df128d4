#include "tests/support/metrics_text.h"

#include <cmath>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>

#include "tests/support/http_client.h"

namespace relit::test {
namespace {

[[noreturn]] void refuse(const std::string& reason, const std::string& line) {
    throw std::runtime_error(reason + ": " + line);
}

double number(const std::string& text, const std::string& line) {
    std::size_t end = 0;
    const double value = std::stod(text, &end);
    if (end != text.size() || std::isnan(value)) refuse("no number", line);
    return value;
}

class Parser {
public:
    void read(const std::string& line) {
        static const std::regex help(R"(# HELP ([a-z_]+) (\S.*))");
        static const std::regex type(R"(# TYPE ([a-z_]+) (counter|gauge|histogram))");
        static const std::regex sample(
            R"re(([a-z_]+)(\{[a-z_]+="(?:[^"\\\n]|\\["\\n])*"(?:,[a-z_]+="(?:[^"\\\n]|\\["\\n])*")*\})? (\S+))re");
        std::smatch match;
        if (std::regex_match(line, match, help)) {
            if (!names_.insert(match[1]).second) refuse("a second HELP", line);
            name_ = match[1];
            type_.clear();
        } else if (std::regex_match(line, match, type)) {
            if (match[1] != name_ || !type_.empty()) refuse("TYPE without its HELP", line);
            type_ = match[2];
        } else if (std::regex_match(line, match, sample)) {
            add(match[1], match[2], number(match[3], line), line);
        } else {
            refuse("not understood", line);
        }
    }

    std::map<std::string, double> samples() {
        for (const auto& [of, last] : ranges_)
            if (last.bound != "+Inf" || last.count != samples_.at(count_name(of)))
                refuse("a histogram without its end", of);
        return std::move(samples_);
    }

private:
    struct Range {
        std::string bound;
        double count = 0;
    };

    void add(const std::string& name, const std::string& labels, double value,
             const std::string& line) {
        const bool is_histogram = type_ == "histogram";
        const std::string ending = name.substr(std::min(name_.size(), name.size()));
        const std::set<std::string> endings =
            is_histogram ? std::set<std::string>{"_bucket", "_sum", "_count"}
                         : std::set<std::string>{""};
        if (type_.empty() || !name.starts_with(name_) || !endings.contains(ending))
            refuse("a sample of no metric", line);
        if (type_ == "counter" && (value < 0 || !name.ends_with("_total")))
            refuse("no counter", line);
        if (!samples_.emplace(name + labels, value).second) refuse("a second sample", line);
        if (ending == "_bucket") add_range(labels, value, line);
    }

    void add_range(const std::string& labels, double count, const std::string& line) {
        static const std::regex bound(R"re((.*?),?le="([^"]+)"\})re");
        std::smatch match;
        if (!std::regex_match(labels, match, bound)) refuse("a range without its end", line);
        auto [range, is_first] = ranges_.try_emplace(name_ + match[1].str());
        if (!is_first &&
            (count < range->second.count || std::stod(match[2]) <= std::stod(range->second.bound)))
            refuse("ranges that fall", line);
        range->second = {match[2], count};
    }

    // `name{route="x"` or `name{` -> `name_count{route="x"}` or `name_count`
    static std::string count_name(const std::string& of) {
        const auto brace = of.find('{');
        const std::string labels = of.substr(brace);
        return of.substr(0, brace) + "_count" + (labels == "{" ? "" : labels + "}");
    }

    std::string name_, type_;
    std::set<std::string> names_;
    std::map<std::string, double> samples_;
    std::map<std::string, Range> ranges_;
};

}  // namespace

std::map<std::string, double> parse_metrics(const std::string& text) {
    if (!text.ends_with('\n')) refuse("no line feed at the end", text);
    Parser parser;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) parser.read(line);
    return parser.samples();
}

double metric_of(int port, const std::string& sample) {
    const auto samples = parse_metrics(http(port, "GET", "/metrics").body);
    const auto found = samples.find(sample);
    return found == samples.end() ? 0 : found->second;
}

}  // namespace relit::test
