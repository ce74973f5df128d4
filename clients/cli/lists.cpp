// relit presets, relit media, relit samples: what ships, listed; a sample as a file.
#include <spdlog/fmt/fmt.h>

#include "clients/cli/commands.h"
#include "clients/cli/input.h"
#include "core/scatter/medium.h"
#include "server/samples/samples.h"
#include "server/schema/client_json.h"
#include "server/schema/media_json.h"
#include "server/schema/presets.h"
#include "server/schema/samples_json.h"

namespace relit::cli {

void presets_command(const Options& options) {
    if (options.json) return write_to_stdout(server::indented(server::presets_json()) + "\n");
    std::string text;
    for (const server::PresetInfo& preset : server::preset_list())
        text += fmt::format("{:<18} {}\n", preset.name, preset.sentence);
    write_to_stdout(text);
}

void media_command(const Options& options) {
    if (options.json) return write_to_stdout(server::indented(server::media_json()) + "\n");
    std::string text;
    for (const scatter::NamedMedium& medium : scatter::measured_media())
        text += fmt::format("{:<24} {} ({})\n", medium.name, medium.title, medium.source);
    write_to_stdout(text);
}

void samples_command(const Options& options, Console console) {
    if (!options.sample.empty()) {
        const Input sample = read_input("sample:" + options.sample);
        check_target(options.output, {});
        return console.outputs.write(options.output, sample.bytes);
    }
    if (options.json) return write_to_stdout(server::indented(server::samples_json()) + "\n");
    std::string text;
    for (const server::Sample& sample : server::samples())
        text += fmt::format("{:<14} {:<12} {} ({}; {})\n", sample.name, sample.kind, sample.title,
                            sample.credit, sample.licence);
    write_to_stdout(text);
}

}  // namespace relit::cli
