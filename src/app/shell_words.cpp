#include "app/shell_words.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string_view>
#include <vector>

namespace trocar::app {
namespace {

struct Word {
    std::string option;   ///< "--json"; the name of a positional
    std::string meaning;  ///< one line
    std::vector<std::string> choices;
    bool takes_value = false;
    bool is_scene = false;
    bool is_positional = false;
};

struct Command {
    std::string name;
    std::string meaning;
    std::string example;
    std::vector<Word> words;
};

/// What CLI::IsMember wrote into the type: "TEXT:{a,b}".
std::vector<std::string> choices_of(const std::string& type) {
    std::vector<std::string> choices;
    const std::size_t first = type.find('{');
    const std::size_t last = type.rfind('}');
    if (first == std::string::npos || last == std::string::npos) return choices;
    std::string word;
    for (const char letter : type.substr(first + 1, last - first - 1) + ",") {
        if (letter != ',') {
            word += letter;
        } else if (!word.empty()) {
            choices.push_back(std::exchange(word, {}));
        }
    }
    return choices;
}

std::vector<Command> commands_of(const CLI::App& app) {
    std::vector<Command> commands;
    for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
        Command command{
            .name = sub->get_name(), .meaning = sub->get_description(), .example = sub->get_footer(), .words = {}};
        for (const CLI::Option* option : sub->get_options()) {
            if (option->get_group().empty()) continue;
            Word word{
                .option = {}, .meaning = option->get_description(), .choices = choices_of(option->get_type_name())};
            word.takes_value = option->get_items_expected_max() > 0;
            word.is_scene = option->get_type_name() == "SCENE";
            word.is_positional = option->get_lnames().empty();
            word.option = word.is_positional ? option->get_name(true) : "--" + option->get_lnames().front();
            command.words.push_back(std::move(word));
        }
        commands.push_back(std::move(command));
    }
    return commands;
}

std::string joined(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, " ")); }

/// Every letter of `special` with `before` in front of it.
std::string escaped(const std::string& text, std::string_view special, const std::string& before) {
    std::string out;
    for (const char letter : text) {
        if (special.find(letter) != std::string_view::npos) out += before;
        out += letter;
    }
    return out;
}

std::string bash_words(const std::vector<Command>& commands) {
    std::vector<std::string> names;
    std::string cases;
    for (const Command& command : commands) {
        names.push_back(command.name);
        std::vector<std::string> options;
        std::string values;
        std::string rest = "COMPREPLY+=($(compgen -f -- \"$word\"))";
        for (const Word& word : command.words) {
            if (!word.is_positional) options.push_back(word.option);
            if (!word.is_positional && !word.choices.empty()) {
                values += fmt::format("        {}) COMPREPLY=($(compgen -W \"{}\" -- \"$word\")); return ;;\n",
                                      word.option, joined(word.choices));
            }
            if (word.is_positional && !word.choices.empty()) {
                rest = fmt::format("COMPREPLY+=($(compgen -W \"{}\" -- \"$word\"))", joined(word.choices));
            }
            if (word.is_positional && word.is_scene) {
                rest += "; COMPREPLY+=($(compgen -W \"$(\"$1\" scenes --names 2>/dev/null)\" -- \"$word\"))";
            }
        }
        cases += fmt::format(
            "    {})\n        case \"$before\" in\n{}        esac\n        if [[ $word == -* ]]; then "
            "COMPREPLY=($(compgen "
            "-W \"{}\" -- \"$word\")); return; fi\n        {} ;;\n",
            command.name, values, joined(options), rest);
    }
    return fmt::format(
        "# bash completion for trocar, written by `trocar completion bash`\n_trocar() {{\n    local "
        "word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}}\n    COMPREPLY=()\n    if ((COMP_CWORD "
        "== "
        "1)); then COMPREPLY=($(compgen -W \"{} --help --version\" -- \"$word\")); return; fi\n    case "
        "${{COMP_WORDS[1]}} in\n{}    esac\n}}\ncomplete -o filenames -F _trocar trocar\n",
        joined(names), cases);
}

std::string zsh_words(const std::vector<Command>& commands) {
    const auto text = [](const std::string& raw) {
        return escaped(escaped(raw, "[]:\\", "\\"), "'", "'\\'");  // for _arguments, then for single quotes
    };
    std::string names;
    std::string cases;
    for (const Command& command : commands) {
        names += fmt::format("    '{}:{}'\n", command.name, escaped(escaped(command.meaning, ":", "\\"), "'", "'\\'"));
        cases += fmt::format("  {}) _arguments", command.name);
        for (const Word& word : command.words) {
            const std::string values = !word.choices.empty() ? "(" + joined(word.choices) + ")"
                                       : word.is_scene       ? "_trocar_scenes"
                                                             : "_files";
            if (word.is_positional) {
                cases += fmt::format(" \\\n    '*:{}:{}'", text(word.option), values);
            } else {
                cases += fmt::format(" \\\n    '{}[{}]{}'", word.option, text(word.meaning),
                                     word.takes_value ? ":value:" + values : std::string());
            }
        }
        cases += " ;;\n";
    }
    return fmt::format(
        "#compdef trocar\n# written by `trocar completion zsh`\n_trocar_scenes() {{ compadd -- $(trocar scenes --names "
        "2>/dev/null); _files }}\n_trocar() {{\n  local -a commands=(\n{}  )\n  if (( CURRENT == 2 )); then _describe "
        "command commands; return; fi\n  shift words; (( CURRENT-- ))\n  case $words[1] in\n{}  esac\n}}\n_trocar "
        "\"$@\"\n",
        names, cases);
}

std::string fish_words(const std::vector<Command>& commands) {
    const auto text = [](const std::string& raw) { return escaped(raw, "'\\", "\\"); };
    std::string script = "# fish completion for trocar, written by `trocar completion fish`\n";
    for (const Command& command : commands) {
        script += fmt::format("complete -c trocar -f -n __fish_use_subcommand -a {} -d '{}'\n", command.name,
                              text(command.meaning));
        const std::string when = fmt::format("-n '__fish_seen_subcommand_from {}'", command.name);
        for (const Word& word : command.words) {
            const std::string values =
                word.choices.empty() ? std::string() : fmt::format(" -x -a '{}'", joined(word.choices));
            if (!word.is_positional) {
                script += fmt::format("complete -c trocar {} -l {}{} -d '{}'\n", when, word.option.substr(2),
                                      values.empty() && word.takes_value ? " -r" : values, text(word.meaning));
            } else if (word.is_scene) {
                script += fmt::format("complete -c trocar {} -a '(trocar scenes --names 2>/dev/null)'\n", when);
            } else if (!values.empty()) {
                script += fmt::format("complete -c trocar {} {}\n", when, values);
            }
        }
    }
    return script;
}

std::string man_page(const CLI::App& app, const std::vector<Command>& commands, const std::string& exit_status,
                     const std::string& version) {
    // A line that begins with a dot or an apostrophe would be a request.
    const auto text = [](const std::string& raw) {
        std::string safe = escaped(raw, "-", "\\");
        for (std::size_t at = 0; (at = safe.find('\n', at)) != std::string::npos; at += 4) safe.insert(at + 1, "\\& ");
        return "\\&" + safe;
    };
    std::string page = fmt::format(
        ".TH TROCAR 1 \"\" \"trocar {}\"\n.SH NAME\ntrocar \\- testbed for collision detectors and contact "
        "responses\n.SH "
        "SYNOPSIS\n.B trocar\n.I COMMAND\n[options]\n.SH DESCRIPTION\n{}\n.SH COMMANDS\n",
        version, text(app.get_description()));
    for (const Command& command : commands) {
        page += fmt::format(".SS trocar {}\n{}.\n", command.name, text(command.meaning));
        for (const Word& word : command.words) {
            page += fmt::format(".TP\n.{} {}\n{}\n", word.is_positional ? "I" : "B", escaped(word.option, "-", "\\"),
                                text(word.meaning));
        }
        if (!command.example.empty()) page += fmt::format(".PP\n.nf\n{}\n.fi\n", text(command.example));
    }
    return page +
           fmt::format(
               ".SH EXIT STATUS\n{}\n.SH ENVIRONMENT\n.TP\n.B TROCAR_DATA\nFolder of the data outside the "
               "project\n.TP\n.B TROCAR_SHARE\nFolder with scenes and bench/studies, asked before trocar's own\n",
               text(exit_status));
}

}  // namespace

std::string shell_words(const CLI::App& app, const std::string& what, const std::string& exit_status,
                        const std::string& version) {
    const std::vector<Command> commands = commands_of(app);
    if (what == "bash") return bash_words(commands);
    if (what == "zsh") return zsh_words(commands);
    if (what == "fish") return fish_words(commands);
    return man_page(app, commands, exit_status, version);
}

}  // namespace trocar::app
