// relit completion: scripts for shells, generated from the declared command line and the field
// table. They hold every word themselves, so that a key press starts no program.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "clients/cli/commands.h"
#include "server/samples/samples.h"
#include "server/schema/batch_request.h"
#include "server/schema/field_paths.h"
#include "server/schema/fields.h"
#include "server/schema/presets.h"

namespace relit::cli {
namespace {

using Words = std::vector<std::string>;

// What may stand in one place of the command line.
struct Values {
    Words words;
    bool files = false;
    bool goes_on = false;  // a word that ends in '=' or ',' is not the whole of it
};

Words sample_words(bool environments_only) {
    Words words;
    for (const server::Sample& sample : server::samples())
        if (!environments_only || sample.kind == "environment")
            words.push_back("sample:" + std::string(sample.name));
    return words;
}

// "relief=", and where a field holds words "output.tone=clip", "output.tone=filmic".
Words setting_words() {
    Words words;
    for (const server::FieldPath& field : server::field_paths()) {
        words.push_back(field.path + "=");
        for (const std::string& word : field.words) words.push_back(field.path + "=" + word);
    }
    return words;
}

Values values_of(const std::string& kind) {
    Values values;
    if (kind == value::image) values = {sample_words(false), true};
    else if (kind == value::environment) values = {sample_words(true), true};
    else if (kind == value::file) values = {{}, true};
    else if (kind == value::setting) values = {setting_words(), false, true};
    else if (kind == value::easing) values = {server::easing_words()};
    else if (kind == value::quality) values = {{lossless_word}};
    else if (kind == value::shell) values = {{"bash", "zsh", "fish"}};
    else if (kind == value::format)
        for (const auto& choice : server::choices_of<PictureFormat>())
            values.words.emplace_back(choice.name);
    else if (kind == value::preset)
        for (const server::PresetInfo& preset : server::preset_list())
            values.words.emplace_back(preset.name);
    else if (kind == value::sample)
        for (const server::Sample& sample : server::samples())
            values.words.emplace_back(sample.name);
    return values;
}

// Every spelling of an option, with its dashes.
Words spellings(const CLI::Option& option) {
    Words words;
    for (const std::string& name : option.get_snames()) words.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) words.push_back("--" + name);
    return words;
}

bool takes_value(const CLI::Option& option) { return option.get_type_size_max() > 0; }

struct Flag {
    Words spellings;
    std::string sentence;
    bool takes_value = false;
    Values values;
};

struct Command {
    std::string name;
    std::string sentence;
    std::vector<Flag> flags;
    Values operands;
};

Command command_of(const CLI::App& app) {
    Command command{app.get_name(), app.get_description(), {}, {}};
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_positional()) {
            command.operands = values_of(option->get_type_name());
            continue;
        }
        const bool has_value = takes_value(*option);
        command.flags.push_back({spellings(*option), option->get_description(), has_value,
                                 has_value ? values_of(option->get_type_name()) : Values{}});
    }
    return command;
}

std::vector<Command> commands_of(const CLI::App& app) {
    std::vector<Command> commands;
    for (const CLI::App* command : app.get_subcommands({}))
        commands.push_back(command_of(*command));
    return commands;
}

std::string joined(const Words& words, std::string_view separator) {
    std::string text;
    for (const std::string& word : words)
        text += (text.empty() ? "" : std::string(separator)) + word;
    return text;
}

Words names_of(const std::vector<Command>& commands) {
    Words names;
    for (const Command& command : commands) names.push_back(command.name);
    return names;
}

// For single quotes of any of the three shells.
std::string shell_quoted(std::string_view text) {
    std::string result = "'";
    for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return result + "'";
}

// --- bash, zsh: a table of cases, then what each shell does with it ------------------------------

// Sets choices, files and goes_on for "command flag", "command" (operands) and "command -" (flags).
std::string cases_of(const std::vector<Command>& commands) {
    std::string text;
    const auto add = [&](const std::string& pattern, const Values& values) {
        text += fmt::format("        {}) choices={} files={} goes_on={} ;;\n", pattern,
                            shell_quoted(joined(values.words, " ")), int(values.files),
                            int(values.goes_on));
    };
    for (const Command& command : commands) {
        Words flags;
        for (const Flag& flag : command.flags) {
            flags.insert(flags.end(), flag.spellings.begin(), flag.spellings.end());
            if (!flag.takes_value) continue;
            Words patterns;
            for (const std::string& spelling : flag.spellings)
                patterns.push_back(shell_quoted(command.name + " " + spelling));
            add(joined(patterns, "|"), flag.values);
        }
        add(shell_quoted(command.name + " -"), {flags});
        add(shell_quoted(command.name), command.operands);
    }
    return text;
}

// Finds the place on the line, in words that both shells understand: `typed` holds the whole words
// before the cursor, `current` what is typed of the last one, --flag=value taken apart.
constexpr std::string_view place = R"(
    local command='' flag='' word rest=0
    for word in "${typed[@]}"; do
        if [[ -z $command ]]; then
            [[ $word == -* ]] || command=$word
        elif [[ -n $flag ]]; then
            flag=''
        elif [[ $word == -- ]]; then
            rest=1
        elif [[ $rest == 0 && $word == -?* && $word != *=* ]] && _relit_takes_value "$command $word"; then
            flag=$word
        fi
    done
    local before=''
    if [[ -z $flag && $rest == 0 && $current == --*=* ]]; then
        flag=${current%%=*} before=${current%%=*}=
        current=${current#*=}
    fi
    local choices='' files=0 goes_on=0
    if [[ -z $command ]]; then
        choices=$top
    elif [[ -n $flag ]]; then
        _relit_values "$command $flag"
    elif [[ $rest == 0 && $current == -* ]]; then
        _relit_values "$command -"
    else
        _relit_values "$command"
    fi
)";

std::string tables(const std::vector<Command>& commands) {
    Words with_value;
    for (const Command& command : commands)
        for (const Flag& flag : command.flags)
            for (const std::string& spelling : flag.spellings)
                if (flag.takes_value)
                    with_value.push_back(shell_quoted(command.name + " " + spelling));
    return fmt::format(R"(_relit_takes_value() {{
    case $1 in
        {}) return 0 ;;
    esac
    return 1
}}

_relit_values() {{
    case $1 in
{}    esac
}}
)",
                       joined(with_value, "|"), cases_of(commands));
}

std::string top_words(const std::vector<Command>& commands) {
    return joined(names_of(commands), " ") + " --help --version";
}

// Bash breaks words at ':' and '=' and replaces what is behind the last of them.
std::string bash_script(const std::vector<Command>& commands) {
    return "# bash completion for relit\n" + tables(commands) + R"(
_relit() {
    local line=${COMP_LINE:0:COMP_POINT} current='' typed=()
    read -a typed <<<"$line"
    if [[ $line != *[[:space:]] ]]; then
        current=${typed[-1]}
        unset 'typed[-1]'
    fi
    typed=("${typed[@]:1}")
    local top=)" +
           shell_quoted(top_words(commands)) + std::string(place) + R"(
    local broken=$before$current kept=''
    [[ $COMP_WORDBREAKS == *:* && $broken == *:* ]] && kept=${broken%"${broken##*:}"}
    [[ $COMP_WORDBREAKS == *=* && $broken == *=* && ${#kept} -lt ${#broken} ]] &&
        kept=${broken%"${broken##*[=:]}"}
    local IFS=$' \t\n' found=() i reply
    mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$current")
    if [[ $files == 1 ]]; then
        mapfile -t found < <(compgen -f -- "$current")
        COMPREPLY+=("${found[@]}")
        compopt -o filenames 2>/dev/null
    fi
    for i in "${!COMPREPLY[@]}"; do
        reply=$before${COMPREPLY[i]}
        COMPREPLY[i]=${reply#"$kept"}
    done
    if [[ $goes_on == 1 && ${#COMPREPLY[@]} -gt 0 && ${COMPREPLY[0]} == *= ]]; then
        compopt -o nospace 2>/dev/null
    fi
}
complete -F _relit relit
)";
}

std::string zsh_script(const std::vector<Command>& commands) {
    return "#compdef relit\n" + tables(commands) + R"(
_relit() {
    setopt localoptions noksharrays noshwordsplit
    local current=${words[CURRENT]}
    local -a typed
    (( CURRENT > 2 )) && typed=("${(@)words[2,CURRENT-1]}")
    _relit_complete "$current" "${typed[@]}"
}

_relit_complete() {
    local current=$1
    shift
    local -a typed
    typed=("$@")
    local top=)" +
           shell_quoted(top_words(commands)) + std::string(place) + R"(
    local -a whole open
    local one
    for one in ${(s: :)choices}; do
        if [[ $goes_on == 1 && $one == *= ]]; then open+=("$one"); else whole+=("$one"); fi
    done
    [[ -n $before ]] && compset -P '*='
    compadd -a whole
    compadd -S '' -a open
    [[ $files == 1 ]] && _files
    return 0
}

if [[ $funcstack[1] == _relit ]]; then
    _relit "$@"
else
    compdef _relit relit
fi
)";
}

// --- fish ----------------------------------------------------------------------------------------

std::string fish_script(const std::vector<Command>& commands) {
    std::string text = "# fish completion for relit\ncomplete -c relit -f\n";
    text += "complete -c relit -n __fish_use_subcommand -l help -d 'Help'\n";
    text += "complete -c relit -n __fish_use_subcommand -l version -d 'Version'\n";
    const auto argument = [](const Values& values) {
        return (values.files ? std::string(" -F") : "") +
               (values.words.empty() ? "" : " -a " + shell_quoted(joined(values.words, " ")));
    };
    for (const Command& command : commands) {
        text += fmt::format("complete -c relit -n __fish_use_subcommand -a {} -d {}\n",
                            command.name, shell_quoted(command.sentence));
        const std::string here =
            fmt::format("complete -c relit -n '__fish_seen_subcommand_from {}'", command.name);
        text += here + argument(command.operands) + "\n";
        for (const Flag& flag : command.flags) {
            text += here;
            for (const std::string& spelling : flag.spellings)
                text += spelling.starts_with("--") ? " -l " + spelling.substr(2)
                                                   : " -s " + spelling.substr(1);
            if (flag.takes_value) text += " -r" + argument(flag.values);
            text += " -d " + shell_quoted(flag.sentence) + "\n";
        }
    }
    return text;
}

}  // namespace

void completion_command(const Options& options, const CLI::App& app) {
    const std::vector<Command> commands = commands_of(app);
    write_to_stdout(options.shell == "bash"  ? bash_script(commands)
                    : options.shell == "zsh" ? zsh_script(commands)
                                             : fish_script(commands));
}

}  // namespace relit::cli
