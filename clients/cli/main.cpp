// relit: relighting from the command line. The command works on a thread of its own; this one waits
// for it, draws its progress and ends the program at once when a signal says so, for decoding and
// waiting for a server cannot be interrupted.
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <csignal>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "clients/cli/commands.h"
#include "clients/cli/failure.h"
#include "core/base/error.h"
#include "core/base/standard_files.h"

namespace relit::cli {
namespace {

constexpr int redraw_ms = 100;

// What ends the program; not what the caller has told it to ignore, as nohup does.
sigset_t stop_signals() {
    sigset_t signals;
    ::sigemptyset(&signals);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction action {};
        ::sigaction(signal, nullptr, &action);
        if (action.sa_handler != SIG_IGN) ::sigaddset(&signals, signal);
    }
    return signals;
}

void run_command(const CLI::App& app, const Options& options, Console console) {
    const CLI::App& command = *app.get_subcommands().front();
    const std::string& name = command.get_name();
    if (name == "render") render_command(options, console);
    else if (name == "sweep") sweep_command(options, console);
    else if (name == "batch") batch_command(options, console);
    else if (name == "scene") scene_command(options, console);
    else if (name == "info") info_command(options, console);
    else if (name == "presets") presets_command(options);
    else if (name == "media") media_command(options);
    else if (name == "samples") samples_command(options, console);
    else if (name == "sign-url") sign_url_command(options);
    else completion_command(options, app);
}

Exit fail(Exit status, const std::string& words, Progress& progress) {
    progress.end();
    if (!words.empty()) std::cerr << "relit: " + words + "\n";
    return status;
}

Exit exit_of(const std::function<void()>& work, Progress& progress) {
    try {
        work();
        progress.end();
        return Exit::ok;
    } catch (const Failure& e) {
        return fail(e.status, e.what(), progress);
    } catch (const Error& e) {
        return fail(Exit::refused, part_of_line(e.what()), progress);
    } catch (const std::bad_alloc&) {
        return fail(Exit::refused, "there is not enough memory", progress);
    } catch (const std::exception& e) {
        return fail(Exit::refused, e.what(), progress);
    }
}

// The second signal meets no handler of ours.
[[noreturn]] void stop(int signal, const sigset_t& signals, Progress& progress,
                       OutputFiles& outputs) {
    ::pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
    progress.end();
    outputs.remove_unfinished();
    std::_Exit(128 + signal);
}

// Waits for the work or for a signal. Only then is the line drawn, so the work never waits for the
// terminal.
void wait_until_done(int done, int stopped, const sigset_t& signals, Progress& progress,
                     OutputFiles& outputs) {
    pollfd waiting[2] = {{.fd = stopped, .events = POLLIN, .revents = 0},
                         {.fd = done, .events = POLLIN, .revents = 0}};
    while (waiting[1].revents == 0) {
        const int ready = ::poll(waiting, 2, redraw_ms);
        signalfd_siginfo info{};
        if (ready > 0 && waiting[0].revents != 0 &&
            ::read(stopped, &info, sizeof info) == ssize_t(sizeof info))
            stop(int(info.ssi_signo), signals, progress, outputs);
        if (ready == 0) progress.draw();
    }
}

Exit run(const CLI::App& app, const Options& options) {
    const sigset_t signals = stop_signals();
    ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // before the first thread: all inherit it
    for (const int by_errno : {SIGPIPE, SIGXFSZ}) std::signal(by_errno, SIG_IGN);
    const int stopped = ::signalfd(-1, &signals, SFD_CLOEXEC);
    const int done = ::eventfd(0, EFD_CLOEXEC);
    Progress progress;
    OutputFiles outputs;
    if (options.quiet) progress.be_quiet();
    Exit status = Exit::ok;
    std::thread working([&] {
        const auto work = [&] { run_command(app, options, {progress, outputs}); };
        status = exit_of(work, progress);
        ::eventfd_write(done, 1);
    });
    wait_until_done(done, stopped, signals, progress, outputs);
    working.join();
    return status;
}

// --help and --version are no failure; what is not understood is said as everything else is.
Exit exit_of(const CLI::App& app, const CLI::ParseError& error) {
    if (error.get_exit_code() == int(CLI::ExitCodes::Success)) {
        app.exit(error, std::cout, std::cerr);
        return std::cout.flush() ? Exit::ok : Exit::unreachable;
    }
    const auto commands = app.get_subcommands();
    const std::string about = commands.empty() ? "" : commands.front()->get_name() + " ";
    const auto unknown = app.remaining();
    const std::string words = commands.empty() && !unknown.empty()
                                  ? "there is no command '" + unknown.front() + "'"
                                  : part_of_line(error.what());
    std::cerr << "relit: " + words + "; see relit " + about + "--help\n";
    return Exit::usage;
}

// The arguments, the last first, as CLI11 wants them. It would take the argument that follows for
// the value of "--flag=".
std::vector<std::string> arguments_of(int argc, char** argv) {
    std::vector<std::string> arguments;
    for (int i = argc - 1; i > 0; --i) {
        std::string argument = argv[i];
        if (argument.starts_with("--") && argument.find('=') == argument.size() - 1) {
            arguments.emplace_back();
            argument.pop_back();
        }
        arguments.push_back(std::move(argument));
    }
    return arguments;
}

}  // namespace
}  // namespace relit::cli

int main(int argc, char** argv) {
    using namespace relit::cli;
    relit::hold_standard_files();
    CLI::App app("Relights height fields.", "relit");
    Options options;
    declare_options(app, options);
    try {
        app.parse(arguments_of(argc, argv));
    } catch (const CLI::ParseError& error) {
        return int(exit_of(app, error));
    }
    return int(run(app, options));
}
