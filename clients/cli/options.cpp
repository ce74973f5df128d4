#include "clients/cli/options.h"

#include <memory>

namespace relit::cli {
namespace {

constexpr const char* exit_statuses = R"(
Exit status: 0 done; 1 an input or a value is refused, or the server says no; 2 the command
line is not understood; 3 a file cannot be read or written, or the server not reached;
130 after Ctrl-C, 143 after SIGTERM.)";

constexpr const char* program_help = R"(Examples:
  relit render relief.png -o out.png --preset bronze
  relit render sample:plato -o plato.jpg --light 0.3,0.8,0.4 --size 800
  relit info relief.png
  relit render --help)";

constexpr const char* scene_help = R"(
FILE is a path, - for stdin, or a sample that ships, as sample:plato (see relit samples).
Stronger wins: defaults < --preset < --scene < the other flags < --set. A scene file that
names a preset itself excludes --preset.
In a scene file {"part": "name"} is a file, from the scene file's folder; {"data": "…"} is
base64; {"image": "…"} is an id or a sample's name (other ids only with --server).
With --server, images go there under the SHA-256 of their bytes, and only those it lacks.)";

constexpr const char* render_help = R"(Examples:
  relit render relief.png -o out.png --light 0.3,0.8,0.4 --preset bronze
  relit render dem.tif -o dem.jpg --sun 315,20 --set relief=0.2 --size 1024
  relit render relief.png -o env.png --env sample:venice-sunset,30,0
  relit render relief.png -o out.exr --scene scene.json --set material.specular.k=0.4
  cat relief.png | relit render - -o - --format jpeg | wc -c
  relit render relief.png -o out.png --server http://127.0.0.1:8080

The format is that of -o's name (.png, .jpg, .webp, .exr) unless --format or output.format says
it; they must not contradict each other. A name without an ending, or -, is a PNG otherwise.)";

constexpr const char* scene_examples = R"(Examples:
  relit scene relief.png --preset wax > scene.json
  relit render relief.png --scene scene.json -o out.png
  relit scene relief.png --set material.depth=0.02 --etag

Prints the scene as JSON, every field filled in, images by their ids; with --etag instead the
ETag that its picture has. Refuses what relit render would refuse.)";

constexpr const char* info_help = R"(Examples:
  relit info relief.png dem.tif
  relit info sample:st-helens --json
  curl -s https://example.org/dem.tif | relit info -

Heights are fractions of the largest number for unsigned integers, else the stored numbers;
not finite and masked texels have no part in the picture. Files that cannot be read are named
on stderr, and the others told all the same; the first of them gives the exit status.)";

constexpr const char* presets_help = R"(Examples:
  relit presets
  relit render sample:head -o head.png --preset marble)";

constexpr const char* samples_help = R"(Examples:
  relit samples
  relit samples plato -o plato.png
  relit render sample:plato -o out.png --env sample:venice-sunset)";

constexpr const char* completion_help = R"(Examples:
  relit completion bash > ~/.local/share/bash-completion/completions/relit
  relit completion zsh > ~/.zfunc/_relit        (with fpath+=~/.zfunc before compinit)
  relit completion fish > ~/.config/fish/completions/relit.fish)";

// What an option takes, and no more: which others it excludes is in its sentence or in the refusal.
class Layout : public CLI::Formatter {
    [[nodiscard]] std::string make_option_opts(const CLI::Option* option) const override {
        if (option->get_type_size() == 0) return "";
        return " " + option->get_type_name() + (option->get_required() ? " (required)" : "");
    }
};

// An empty variable of a script is not taken for a flag that is not there.
CLI::Validator not_empty() {
    return {[](const std::string& value) { return value.empty() ? "is empty" : ""; }, ""};
}

CLI::Option* text(CLI::App& app, const std::string& flag, std::string& target,
                  const std::string& sentence, const char* kind) {
    return app.add_option(flag, target, sentence)->type_name(kind)->check(not_empty());
}

void declare_quiet(CLI::App& app, Options& options) {
    app.add_flag("-q,--quiet", options.quiet, "No progress and no notes on stderr");
}

void declare_scene(CLI::App& app, Options& options) {
    SceneOptions& scene = options.scene;
    text(app, "relief", scene.relief, "The height map, bright is near", value::image);
    text(app, "--preset", scene.preset, "A look to start from; see relit presets", value::preset);
    text(app, "--scene", scene.scene, "A scene as JSON, or - for stdin", value::file);
    auto* light =
        text(app, "--light", scene.light,
             "A point light: x and y as fractions of the map, z towards the viewer", "X,Y,Z");
    auto* sun =
        text(app, "--sun", scene.sun, "A light from far away, in degrees", "AZIMUTH,ELEVATION");
    auto* env =
        text(app, "--env", scene.env,
             "Light from an environment image: FILE[,YAW[,PITCH]], in degrees", value::environment);
    light->excludes(sun)->excludes(env);
    sun->excludes(env);
    text(app, "--alpha", scene.alpha, "Mask: below one half is no material", value::image);
    text(app, "--albedo", scene.albedo, "Colour of every texel", value::image);
    text(app, "--size", scene.size, "Pixels of the picture: WxH, W or xH", "SIZE");
    text(app, "--format", scene.format, "png, jpeg, webp or exr", value::format);
    app.add_option("--set", scene.set, "Any field: material.specular.k=0.4; may be repeated")
        ->type_name(value::setting)
        ->check(not_empty())
        ->allow_extra_args(false);
    app.add_option("--threads", scene.threads, "Threads that render; 0: one per processor")
        ->check(not_empty())
        ->check(CLI::Range(0, 1024).description(""))
        ->type_name("N");
    text(app, "--server", scene.server, "Let a server do it: http://… or https://…", "URL");
    declare_quiet(app, options);
}

void declare_render(CLI::App& app, Options& options) {
    CLI::App& render = *app.add_subcommand("render", "Makes a picture of a relief");
    declare_scene(render, options);
    text(render, "-o,--output", options.output, "Where the picture goes; - for stdout", value::file)
        ->required();
    render.footer(std::string(render_help) + "\n" + scene_help + "\n" + exit_statuses);
}

void declare_dry_run(CLI::App& app, Options& options) {
    CLI::App& scene =
        *app.add_subcommand("scene", "Checks a scene and prints it whole: a dry run of render");
    declare_scene(scene, options);
    scene.add_flag("--etag", options.etag, "Print the picture's ETag instead");
    scene.footer(std::string(scene_examples) + "\n" + scene_help + "\n" + exit_statuses);
}

void declare_info(CLI::App& app, Options& options) {
    CLI::App& info = *app.add_subcommand("info", "Says what an image holds");
    info.add_option("files", options.files, "Images")
        ->type_name(value::image)
        ->check(not_empty())
        ->required();
    info.add_flag("--json", options.json, "For machines");
    declare_quiet(info, options);
    info.footer(std::string(info_help) + "\n" + exit_statuses);
}

void declare_presets(CLI::App& app, Options& options) {
    CLI::App& presets = *app.add_subcommand("presets", "Lists the looks to start from");
    presets.add_flag("--json", options.json, "For machines, with their scenes");
    presets.footer(presets_help);
}

void declare_samples(CLI::App& app, Options& options) {
    CLI::App& samples =
        *app.add_subcommand("samples", "Lists the images that ship, or writes one out");
    auto* sample = text(samples, "sample", options.sample, "The one to write", value::sample);
    auto* output =
        text(samples, "-o,--output", options.output, "Where it goes; - for stdout", value::file);
    auto* json = samples.add_flag("--json", options.json, "The list for machines");
    sample->needs(output)->excludes(json);
    output->needs(sample);
    samples.footer(std::string(samples_help) + "\n" + exit_statuses);
}

void declare_completion(CLI::App& app, Options& options) {
    CLI::App& completion =
        *app.add_subcommand("completion", "Prints a completion script for a shell");
    text(completion, "shell", options.shell, "bash, zsh or fish", value::shell)
        ->required()
        ->check(CLI::IsMember({"bash", "zsh", "fish"}).description(""));
    completion.footer(completion_help);
}

}  // namespace

void declare_options(CLI::App& app, Options& options) {
    app.set_version_flag("--version", "relit " RELIT_VERSION);
    app.formatter(std::make_shared<Layout>());
    app.get_formatter()->column_width(32);
    app.require_subcommand(1);
    app.footer(std::string(program_help) + "\n" + exit_statuses);
    declare_render(app, options);
    declare_dry_run(app, options);
    declare_info(app, options);
    declare_presets(app, options);
    declare_samples(app, options);
    declare_completion(app, options);
}

}  // namespace relit::cli
