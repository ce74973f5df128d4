#include "clients/cli/options.h"

#include <CLI/CLI.hpp>

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
  relit sweep relief.png --orbit 120 -o frames/
  relit info relief.png
  relit render --help)";

constexpr const char* scene_help = R"(
FILE is a path, - for stdin, or a sample that ships, as sample:plato (see relit samples).
Stronger wins: defaults < --preset < --scene < the other flags < --set. A scene file that
names a preset itself excludes --preset.
In a scene file {"part": "name"} is a file, from the scene file's folder; {"data": "…"} is
base64; {"image": "…"} is an id or a sample's name (other ids only with --server).
With --server, images go there under the SHA-256 of their bytes, and only those it lacks; a
server that asks for a key gets what is in RELIT_API_KEY.)";

constexpr const char* render_help = R"(Examples:
  relit render relief.png -o out.png --light 0.3,0.8,0.4 --preset bronze
  relit render dem.tif -o dem.jpg --sun 315,20 --set relief=0.2 --size 1024
  relit render relief.png -o env.png --env sample:venice-sunset,30,0
  relit render relief.png -o out.exr --scene scene.json --set material.specular.k=0.4
  cat relief.png | relit render - -o - --format jpeg | wc -c
  relit render relief.png -o out.png --server http://127.0.0.1:8080

The format is that of -o's name (.png, .jpg, .webp, .exr) unless --format or output.format says
it; they must not contradict each other. A name without an ending, or -, is a PNG otherwise.)";

constexpr const char* sweep_help = R"(Examples:
  relit sweep relief.png --orbit 120 -o frames/
  relit sweep relief.png --orbit 120 --elevation 20 --turns -1 --preset bronze -o frames/
  relit sweep dem.tif --arc 90 --from 90,5 --to 270,5 --easing ease-in-out -o day/
  relit sweep relief.png --line 60 --from 0,1,0.4 --to 1,1,0.4 --returns -o frames/
  relit sweep relief.png --env sample:venice-sunset --turn 120 -o frames/ --format jpeg
  relit sweep relief.png --orbit 120 -o frames/ --animation orbit.webp --fps 30
  ffmpeg -framerate 30 -i frames/%04d.png -pix_fmt yuv420p orbit.mp4

--orbit takes a sun round the relief at one --elevation, --arc takes it --from one direction
--to another, --line takes a point light, --turn turns the environment. The frame that would
be the first one again is left out, so that --orbit, --turn and --returns make loops.)";

constexpr const char* batch_help = R"(Examples:
  relit batch manifest.jsonl -o frames/
  relit batch manifest.jsonl -o frames/ --server http://127.0.0.1:8080
  jq -c '.frames[]' plan.json | relit batch - -o frames/

A manifest has one scene a line, as JSON: {"name": "a.png", "scene": {…}}, or the scene by
itself. Frames without a name are 0000.png, 0001.png, … by their place. In a scene
{"part": "relief.png"} is a file, from the manifest's folder; {"data": "…"} is base64;
{"image": "…"} is an id or a sample's name (other ids only with --server).)";

constexpr const char* frames_help = R"(
A frame is there whole or not at all. The same command again, after Ctrl-C or a crash, makes
what is missing: frames that are there and of the same scene are left alone, as the files
.relit-frames* in the folder tell. A frame that fails is named on stderr and does not stop the
others; the exit status is 1 then.
--shard 2/8 makes the third eighth of the frames, by itself or beside the others:
  sbatch --array=0-7 --wrap 'relit sweep r.png --orbit 720 -o f --shard $SLURM_ARRAY_TASK_ID/8'
  relit batch m.jsonl -o /out --shard $JOB_COMPLETION_INDEX/8   (a Kubernetes indexed job)
--animation makes one animated WebP of the frames, in their order, when all are there; of a
size, not OpenEXR. After shards, the same command over their folder without --shard makes it.
With --server the frames are a batch there, which goes on while nobody asks for it.)";

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

constexpr const char* media_help = R"(Examples:
  relit media
  relit render sample:head -o head.png --set material.model=dipole --set material.medium=skin1)";

constexpr const char* samples_help = R"(Examples:
  relit samples
  relit samples plato -o plato.png
  relit render sample:plato -o out.png --env sample:venice-sunset)";

constexpr const char* sign_url_help = R"(Examples:
  export RELIT_API_KEY=…
  relit sign-url 'https://relit.example.org/v1/images/c19f…/relit.png?sun=300,40' --valid 3600

Prints the URL with the parameters expires and signature: until then it is good for GET without
a key, for <img src> above all, as long as the key that signed it is. Nothing behind the path
may be changed. Nobody is asked: signing takes no server.)";

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

void declare_threads_and_server(CLI::App& app, Options& options) {
    app.add_option("--threads", options.scene.threads, "Threads that render; 0: one per processor")
        ->check(not_empty())
        ->check(CLI::Range(0, 1024).description(""))
        ->type_name("N");
    text(app, "--server", options.scene.server, "Let a server do it: http://… or https://…", "URL");
    declare_quiet(app, options);
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
    text(app, "--bump", scene.bump, "Fine relief that shading alone shows", value::image);
    text(app, "--size", scene.size, "Pixels of the picture: WxH, W or xH", "SIZE");
    text(app, "--format", scene.format, "png, jpeg, webp or exr", value::format);
    app.add_option("--set", scene.set, "Any field: material.specular.k=0.4; may be repeated")
        ->type_name(value::setting)
        ->check(not_empty())
        ->allow_extra_args(false);
    declare_threads_and_server(app, options);
}

void declare_render(CLI::App& app, Options& options) {
    CLI::App& render = *app.add_subcommand("render", "Makes a picture of a relief");
    declare_scene(render, options);
    text(render, "-o,--output", options.output, "Where the picture goes; - for stdout", value::file)
        ->required();
    render.footer(std::string(render_help) + "\n" + scene_help + "\n" + exit_statuses);
}

void declare_frames(CLI::App& app, Options& options) {
    text(app, "-o,--output", options.output, "The folder of the frames; made if need be",
         value::file)
        ->required();
    text(app, "--shard", options.shard, "A part of the frames: 0/8 to 7/8", "I/N");
    AnimationFlags& flags = options.animation;
    auto* animation = text(app, "--animation", flags.target,
                           "All frames as one animated WebP too; - for stdout", value::file);
    text(app, "--fps", flags.frames_per_second, "Its frames a second, 1 to 90; 25 if not said",
         "NUMBER")
        ->needs(animation);
    text(app, "--animation-quality", flags.quality,
         "Its quality, 1 to 100 or lossless; 85 if not said", value::quality)
        ->needs(animation);
}

void declare_sweep(CLI::App& app, Options& options) {
    CLI::App& sweep = *app.add_subcommand("sweep", "Makes many pictures, the light on its way");
    SweepOptions& path = options.sweep;
    auto* orbit =
        text(sweep, "--orbit", path.orbit, "A sun goes round, in so many frames", "COUNT");
    auto* arc =
        text(sweep, "--arc", path.arc, "A sun goes --from azimuth,elevation --to others", "COUNT");
    auto* line = text(sweep, "--line", path.line,
                      "A point light goes --from X,Y,Z --to another place", "COUNT");
    auto* turn =
        text(sweep, "--turn", path.turn, "The environment turns about the vertical", "COUNT");
    orbit->excludes(arc)->excludes(line)->excludes(turn);
    arc->excludes(line)->excludes(turn);
    line->excludes(turn);
    text(sweep, "--from", path.from, "Where an arc or a line begins", "PLACE");
    text(sweep, "--to", path.to, "Where it ends", "PLACE");
    sweep.add_flag("--returns", path.returns, "An arc or a line goes back again, the same way");
    text(sweep, "--azimuth", path.azimuth, "Where an orbit begins, in degrees", "DEGREES");
    text(sweep, "--elevation", path.elevation, "An orbit's height, in degrees", "DEGREES");
    text(sweep, "--turns", path.turns, "Of --orbit and --turn; below 0: the other way", "COUNT");
    text(sweep, "--easing", path.easing, "linear, ease-in, ease-out or ease-in-out", value::easing);
    text(sweep, "--moved-light", path.light, "Which of several lights moves, from 0", "NUMBER");
    declare_scene(sweep, options);
    declare_frames(sweep, options);
    sweep.footer(std::string(sweep_help) + "\n" + frames_help + "\n" + scene_help + "\n" +
                 exit_statuses);
}

void declare_batch(CLI::App& app, Options& options) {
    CLI::App& batch = *app.add_subcommand("batch", "Makes the pictures of a list of scenes");
    text(batch, "manifest", options.manifest, "A scene a line, as JSON; - for stdin", value::file)
        ->required();
    declare_frames(batch, options);
    declare_threads_and_server(batch, options);
    batch.footer(std::string(batch_help) + "\n" + frames_help + "\n" + exit_statuses);
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

void declare_media(CLI::App& app, Options& options) {
    CLI::App& media = *app.add_subcommand("media", "Lists measured media for material.medium");
    media.add_flag("--json", options.json, "For machines, with their numbers");
    media.footer(media_help);
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

void declare_sign_url(CLI::App& app, Options& options) {
    CLI::App& sign =
        *app.add_subcommand("sign-url", "Signs a server's URL, to be used without a key");
    text(sign, "url", options.url, "The URL, or its path and query", "URL")->required();
    sign.add_option("--valid", options.valid_s, "Until it expires; a day if not said")
        ->check(not_empty())
        ->check(CLI::Range(1, 10 * 365 * 86400).description(""))
        ->type_name("SECONDS");
    sign.footer(std::string(sign_url_help) + "\n" + exit_statuses);
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
    declare_sweep(app, options);
    declare_batch(app, options);
    declare_dry_run(app, options);
    declare_info(app, options);
    declare_presets(app, options);
    declare_media(app, options);
    declare_samples(app, options);
    declare_sign_url(app, options);
    declare_completion(app, options);
}

}  // namespace relit::cli
