// The commands of relit, one function each. They write their result to stdout or a file, and throw
// Failure or Error where they cannot.
#pragma once

#include "clients/cli/options.h"
#include "clients/cli/output_file.h"
#include "clients/cli/progress.h"

namespace relit::cli {

/// What a command tells and writes through.
struct Console {
    Progress& progress;
    OutputFiles& outputs;
};

void render_command(const Options& options, Console console);
void sweep_command(const Options& options, Console console);
void batch_command(const Options& options, Console console);
void scene_command(const Options& options, Console console);
void info_command(const Options& options, Console console);
void presets_command(const Options& options);
void media_command(const Options& options);
void samples_command(const Options& options, Console console);
void sign_url_command(const Options& options);

/// @param app  as declare_options() declared it: the script completes what it says
void completion_command(const Options& options, const CLI::App& app);

}  // namespace relit::cli
