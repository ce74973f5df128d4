// Prometheus's text format, version 0.0.4, read as strictly as it is specified.
#pragma once

#include <map>
#include <string>

namespace relit::test {

/// Samples by name and labels as they stand in the text: `name{label="value"}`.
///
/// @throws std::runtime_error with the line that breaks a rule: a sample without HELP and TYPE
///         before it, a metric in two places, a sample twice, a value that is no number, a label
///         with a character that is not escaped, a counter below 0, a histogram whose ranges fall,
///         lack +Inf or disagree with its count
[[nodiscard]] std::map<std::string, double> parse_metrics(const std::string& text);

/// The sample's value of the server at `port`, 0 where there is none.
[[nodiscard]] double metric_of(int port, const std::string& sample);

}  // namespace relit::test
