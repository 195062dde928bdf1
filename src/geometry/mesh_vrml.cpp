// VRML 2.0 (ISO/IEC 14772, "VRML97"): the scene graph's IndexedFaceSets in world coordinates of the file. Transform,
// grouping nodes, Switch, LOD and DEF/USE are evaluated. Prototypes, scripts, routes and appearance are skipped.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "geometry/mesh_text.hpp"

namespace trocar::mesh_text {
namespace {

// Limits against files that would exhaust stack or memory (nested brackets; DEF/USE that doubles at every level).
constexpr int deepest_nesting = 500;
constexpr std::int64_t most_visits = 10'000'000;
constexpr std::int64_t most_vertices = 200'000'000;

enum class TokenKind : std::uint8_t { end, word, number, text, punctuation };

struct Token {
    TokenKind kind = TokenKind::end;
    std::string_view text;
    double number = 0.0;
    std::int64_t line = 1;
    [[nodiscard]] bool is(char c) const { return kind == TokenKind::punctuation && text.front() == c; }
    [[nodiscard]] bool is(std::string_view word) const { return kind == TokenKind::word && text == word; }
};

std::string described(const Token& token) { return token.kind == TokenKind::end ? "end of file" : quoted(token.text); }

class Lexer {
public:
    explicit Lexer(const Source& source) : source_(source) { advance(); }
    [[nodiscard]] const Token& peek() const { return token_; }
    Token take() {
        const Token token = token_;
        advance();
        return token;
    }

private:
    static bool is_separator(char c) {
        return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == ',' || c == '\f' || c == '\v';
    }
    static bool ends_word(char c) {
        return is_separator(c) || c == '{' || c == '}' || c == '[' || c == ']' || c == '"' || c == '#';
    }

    void advance() {
        const std::string_view text = source_.text;
        for (; at_ < text.size(); ++at_) {
            const char c = text[at_];
            if (c == '#') {
                at_ = std::min(text.find_first_of("\r\n", at_), text.size());
                if (at_ == text.size()) break;
            } else if (!is_separator(c)) {
                break;
            }
            count_line(at_);
        }
        token_ = {.kind = TokenKind::end, .text = {}, .number = 0.0, .line = line_};
        if (at_ >= text.size()) return;
        const char c = text[at_];
        if (c == '"') {
            take_string();
        } else if (ends_word(c)) {
            token_.kind = TokenKind::punctuation;
            token_.text = text.substr(at_++, 1);
        } else {
            const std::size_t first = at_;
            while (at_ < text.size() && !ends_word(text[at_])) ++at_;
            token_.text = text.substr(first, at_ - first);
            classify_word();
        }
    }

    void take_string() {
        const std::string_view text = source_.text;
        const std::size_t first = at_++;
        while (at_ < text.size() && text[at_] != '"') {
            if (text[at_] == '\\' && at_ + 1 < text.size()) ++at_;
            count_line(at_);
            ++at_;
        }
        if (at_ >= text.size()) fail_line(source_, token_.line, "the closing quote of a string", "end of file");
        ++at_;
        token_.kind = TokenKind::text;
        token_.text = text.substr(first, at_ - first);
    }

    void classify_word() {
        const std::string_view text = token_.text;
        token_.kind = TokenKind::number;
        if (const std::optional<double> value = parse_double(text)) {  // also nan and inf, refused where they are used
            token_.number = *value;
            return;
        }
        const std::size_t sign = text.front() == '-' || text.front() == '+' ? 1 : 0;
        const std::string_view unsigned_text = text.substr(sign);
        if (unsigned_text.starts_with("0x") || unsigned_text.starts_with("0X")) {  // as the pixels of an image
            const std::string_view digits = unsigned_text.substr(2);
            if (digits.empty()) fail_line(source_, line_, "a number", quoted(text));
            for (const char c : digits) {
                const std::size_t digit = std::string_view("0123456789abcdefABCDEF").find(c);
                if (digit == std::string_view::npos) fail_line(source_, line_, "a number", quoted(text));
                token_.number = token_.number * 16.0 + static_cast<double>(digit < 16 ? digit : digit - 6);
            }
            if (text.front() == '-') token_.number = -token_.number;
            return;
        }
        const char c = text.front();
        if (sign == 1 || c == '.' || (c >= '0' && c <= '9')) fail_line(source_, line_, "a number", quoted(text));
        token_.kind = TokenKind::word;
    }

    void count_line(std::size_t at) {
        const std::string_view text = source_.text;
        if (text[at] == '\n' && (at == 0 || text[at - 1] != '\r')) ++line_;
        if (text[at] == '\r') ++line_;
    }

    const Source& source_;
    std::size_t at_ = 0;
    std::int64_t line_ = 1;
    Token token_;
};

/// A node's field: numbers (TRUE is 1, FALSE 0), or nodes by number; -1 is NULL.
struct Value {
    std::vector<double> numbers;
    std::vector<std::int64_t> lines;  ///< of each number
    std::vector<int> nodes;
    std::int64_t line = 0;
};

struct Node {
    std::string_view type;
    std::int64_t line = 0;
    std::map<std::string_view, Value> fields;
};

class VrmlReader {
public:
    explicit VrmlReader(const Source& source) : source_(checked(source)), lexer_(source), builder_(source) {}

    Mesh read() {
        read_comments();
        std::vector<int> roots;
        while (lexer_.peek().kind != TokenKind::end) {
            if (!skip_statement()) roots.push_back(parse_node(0));
        }
        for (const int root : roots) visit(root, Eigen::Affine3d::Identity());
        Mesh mesh = builder_.finish("vrml");
        mesh.ignored = std::move(ignored_);
        return mesh;
    }

private:
    [[noreturn]] void fail(std::int64_t line, std::string_view expected, std::string_view found) const {
        fail_line(source_, line, expected, found);
    }

    static const Source& checked(const Source& source) {
        if (!source.text.starts_with("#VRML V2.0 utf8")) {
            fail_line(source, 1, "'#VRML V2.0 utf8'", quoted(source.text.substr(0, source.text.find_first_of("\r\n"))));
        }
        return source;
    }

    void read_comments() {
        LineReader lines(source_.text);
        std::string_view line;
        while (lines.next(line)) {
            if (line.starts_with('#')) builder_.read_unit(line);
        }
    }

    // ---- reading the tree -------------------------------------------------------------------------------------------

    Token expect_word(std::string_view what) {
        const Token token = lexer_.take();
        if (token.kind != TokenKind::word) fail(token.line, what, described(token));
        return token;
    }

    /// Skips from the next bracket to its partner.
    void skip_bracket(char open) {
        const Token first = lexer_.take();
        if (!first.is(open)) fail(first.line, fmt::format("'{}'", open), described(first));
        std::string closing;
        closing.push_back(open == '{' ? '}' : ']');
        while (!closing.empty()) {
            const Token token = lexer_.take();
            if (token.kind == TokenKind::end) {
                fail(token.line, fmt::format("the partner of '{}' of line {}", open, first.line), "end of file");
            }
            if (token.is('{')) closing.push_back('}');
            if (token.is('[')) closing.push_back(']');
            if (token.is('}') || token.is(']')) {
                if (!token.is(closing.back())) fail(token.line, fmt::format("'{}'", closing.back()), described(token));
                closing.pop_back();
            }
        }
    }

    /// PROTO, EXTERNPROTO and ROUTE, which are valid wherever a node or a field is.
    bool skip_statement() {
        if (lexer_.peek().is("ROUTE")) {
            lexer_.take();
            expect_word("the start of a route");
            if (const Token to = lexer_.take(); !to.is("TO")) fail(to.line, "'TO'", described(to));
            expect_word("the end of a route");
            return true;
        }
        const bool external = lexer_.peek().is("EXTERNPROTO");
        if (!external && !lexer_.peek().is("PROTO")) return false;
        const std::int64_t line = lexer_.take().line;
        const Token name = expect_word("the name of a prototype");
        ignored_.push_back(fmt::format("line {}: prototype {}", line, name.text));
        skip_bracket('[');
        if (!external) {
            skip_bracket('{');
        } else if (lexer_.peek().is('[')) {
            skip_bracket('[');
        } else if (lexer_.peek().kind == TokenKind::text) {
            lexer_.take();
        }
        return true;
    }

    /// [DEF name] Type { … } or USE name or NULL; returns the node's number.
    int parse_node(int depth) {
        Token token = expect_word("a node");
        if (depth > deepest_nesting) {
            fail(token.line, fmt::format("nodes nested at most {} deep", deepest_nesting), "more");
        }
        if (token.is("NULL")) return -1;
        if (token.is("USE")) {
            const Token name = expect_word("a name after USE");
            const auto found = names_.find(name.text);
            if (found == names_.end()) fail(name.line, "a name that DEF has given before", described(name));
            return found->second;
        }
        std::string_view defined;
        if (token.is("DEF")) {
            defined = expect_word("a name after DEF").text;
            token = expect_word("a node after DEF and its name");
        }
        Node node{.type = token.text, .line = token.line, .fields = {}};
        if (const Token open = lexer_.take(); !open.is('{')) {
            fail(open.line, fmt::format("'{{' after the node type '{}'", token.text), described(open));
        }
        while (!lexer_.peek().is('}')) {
            if (!skip_statement()) parse_field(node, depth);
        }
        lexer_.take();
        nodes_.push_back(std::move(node));
        const int number = static_cast<int>(nodes_.size()) - 1;
        if (!defined.empty()) names_[defined] = number;  // only now, so that no node can contain itself
        return number;
    }

    void parse_field(Node& node, int depth) {
        Token name = lexer_.take();
        if (name.kind == TokenKind::end) {
            fail(name.line, fmt::format("'}}' of the {} of line {}", node.type, node.line), "end of file");
        }
        if (name.kind != TokenKind::word)
            fail(name.line, fmt::format("a field name of {}", node.type), described(name));
        // Declarations inside a Script.
        const bool event = name.is("eventIn") || name.is("eventOut");
        if (event || name.is("field") || name.is("exposedField")) {
            expect_word("a field type");
            name = expect_word("a field name");
        }
        if (lexer_.peek().is("IS")) {
            lexer_.take();
            expect_word("a name after IS");
            return;
        }
        if (event) return;
        Value& value = node.fields[name.text];
        value = {};
        value.line = name.line;
        parse_value(value, name, depth);
    }

    void parse_value(Value& value, const Token& field, int depth) {
        const Token& next = lexer_.peek();
        if (next.kind == TokenKind::number || next.kind == TokenKind::text) {
            while (parse_plain(value)) {
            }
        } else if (next.is('[')) {
            const std::int64_t line = lexer_.take().line;
            while (!lexer_.peek().is(']')) {
                if (parse_plain(value) || parse_truth(value)) continue;
                if (lexer_.peek().kind == TokenKind::end) {
                    fail(lexer_.peek().line, fmt::format("']' of the list '{}' of line {}", field.text, line),
                         "end of file");
                }
                if (!skip_statement()) value.nodes.push_back(parse_node(depth + 1));
            }
            lexer_.take();
        } else if (!parse_truth(value)) {
            if (next.kind != TokenKind::word)
                fail(next.line, fmt::format("a value of '{}'", field.text), described(next));
            value.nodes.push_back(parse_node(depth + 1));
        }
    }

    /// Reads a number or skips a string, if one comes next; else false.
    bool parse_plain(Value& value) {
        const Token& next = lexer_.peek();
        if (next.kind == TokenKind::number) {
            value.numbers.push_back(next.number);
            value.lines.push_back(next.line);
        } else if (next.kind != TokenKind::text) {
            return false;
        }
        lexer_.take();
        return true;
    }

    bool parse_truth(Value& value) {
        const Token& next = lexer_.peek();
        if (!next.is("TRUE") && !next.is("FALSE")) return false;
        value.numbers.push_back(next.is("TRUE") ? 1.0 : 0.0);
        value.lines.push_back(next.line);
        lexer_.take();
        return true;
    }

    // ---- reading values
    // -----------------------------------------------------------------------------------------------

    static const Value* field(const Node& node, std::string_view name) {
        const auto found = node.fields.find(name);
        return found == node.fields.end() ? nullptr : &found->second;
    }

    double finite(const Value& value, std::size_t i, std::string_view name) const {
        if (!std::isfinite(value.numbers[i])) {
            fail(value.lines[i], fmt::format("a finite number in '{}'", name), fmt::format("'{}'", value.numbers[i]));
        }
        return value.numbers[i];
    }

    template <int N>
    Eigen::Matrix<double, N, 1> vector(const Node& node, std::string_view name,
                                       const Eigen::Matrix<double, N, 1>& fallback) const {
        const Value* value = field(node, name);
        if (value == nullptr) return fallback;
        if (value->numbers.size() != N) {
            fail(value->line, fmt::format("{} numbers after '{}'", N, name), std::to_string(value->numbers.size()));
        }
        Eigen::Matrix<double, N, 1> result;
        for (int i = 0; i < N; ++i) result[i] = finite(*value, static_cast<std::size_t>(i), name);
        return result;
    }

    Eigen::AngleAxisd rotation(const Node& node, std::string_view name) const {
        const Eigen::Vector4d v = vector<4>(node, name, Eigen::Vector4d(0, 0, 1, 0));
        const double length = v.head<3>().norm();
        if (length > 0.0) return {v[3], v.head<3>() / length};
        if (v[3] != 0.0) fail(field(node, name)->line, fmt::format("an axis other than zero in '{}'", name), "'0 0 0'");
        return {0.0, Vector3::UnitZ()};
    }

    /// P' = T · C · R · SR · S · −SR · −C · P (ISO/IEC 14772-1, 6.52).
    Eigen::Affine3d local_transform(const Node& node) const {
        const Vector3 center = vector<3>(node, "center", Vector3::Zero());
        const Eigen::AngleAxisd scale_orientation = rotation(node, "scaleOrientation");
        Eigen::Affine3d result = Eigen::Affine3d::Identity();
        result.translate(vector<3>(node, "translation", Vector3::Zero()));
        result.translate(center);
        result.rotate(rotation(node, "rotation"));
        result.rotate(scale_orientation);
        result.scale(vector<3>(node, "scale", Vector3::Ones()));
        result.rotate(scale_orientation.inverse());
        result.translate(Vector3(-center));
        return result;
    }

    bool flag(const Node& node, std::string_view name, bool fallback) const {
        const Value* value = field(node, name);
        if (value == nullptr) return fallback;
        if (value->numbers.size() != 1)
            fail(value->line, fmt::format("TRUE or FALSE after '{}'", name), "another value");
        return value->numbers[0] != 0.0;
    }

    // ---- walking the tree
    // ---------------------------------------------------------------------------------------------

    void visit(int number, const Eigen::Affine3d& to_world) {
        if (number < 0) return;
        const Node& node = nodes_[static_cast<std::size_t>(number)];
        if (++visits_ > most_visits) fail(node.line, fmt::format("at most {} nodes after USE", most_visits), "more");
        report_unread_geometry(node);
        if (node.type == "Transform") {
            visit_all(field(node, "children"), to_world * local_transform(node));
        } else if (node.type == "Group" || node.type == "Anchor" || node.type == "Collision" ||
                   node.type == "Billboard") {
            visit_all(field(node, "children"), to_world);
        } else if (node.type == "Switch") {
            const double choice = vector<1>(node, "whichChoice", Eigen::Matrix<double, 1, 1>(-1.0))[0];
            visit_one(field(node, "choice"), choice, to_world);
        } else if (node.type == "LOD") {
            visit_one(field(node, "level"), 0.0, to_world);
        } else if (node.type == "Shape") {
            const Value* geometry = field(node, "geometry");
            if (geometry == nullptr) return;
            for (const int part : geometry->nodes) {
                if (part >= 0) add_geometry(nodes_[static_cast<std::size_t>(part)], to_world);
            }
        } else if (node.type == "Inline" || field(node, "children") != nullptr) {
            ignored_.push_back(fmt::format("line {}: {}", node.line, node.type));
        }
    }

    /// Reports a surface or a group in a field that does not take it (a misspelt name), which would be left out
    /// silently.
    void report_unread_geometry(const Node& node) {
        if (node.type == "Script") return;  // refers to nodes in other places
        constexpr std::array<std::string_view, 5> read{"children", "geometry", "choice", "level", "proxy"};
        constexpr std::array<std::string_view, 10> holders{"Shape",     "Transform",     "Group",  "Anchor",
                                                           "Collision", "Billboard",     "Switch", "LOD",
                                                           "Inline",    "IndexedFaceSet"};
        for (const auto& [name, value] : node.fields) {
            if (std::find(read.begin(), read.end(), name) != read.end()) continue;
            for (const int child : value.nodes) {
                if (child < 0) continue;
                const std::string_view type = nodes_[static_cast<std::size_t>(child)].type;
                if (std::find(holders.begin(), holders.end(), type) == holders.end()) continue;
                ignored_.push_back(fmt::format("line {}: {} in field '{}' of {}", value.line, type, name, node.type));
            }
        }
    }

    void visit_all(const Value* children, const Eigen::Affine3d& to_world) {
        if (children == nullptr) return;
        for (const int child : children->nodes) visit(child, to_world);
    }

    void visit_one(const Value* choices, double choice, const Eigen::Affine3d& to_world) {
        if (choices == nullptr || choice < 0.0 || choice >= static_cast<double>(choices->nodes.size())) return;
        visit(choices->nodes[static_cast<std::size_t>(choice)], to_world);
    }

    void add_geometry(const Node& set, const Eigen::Affine3d& to_world) {
        if (set.type != "IndexedFaceSet") {
            const bool surface = set.type != "IndexedLineSet" && set.type != "PointSet" && set.type != "Text";
            if (surface) ignored_.push_back(fmt::format("line {}: {}", set.line, set.type));
            return;
        }
        const std::int64_t first = builder_.vertex_count();
        std::int64_t count = 0;
        const Value* coord = field(set, "coord");
        if (coord != nullptr && !coord->nodes.empty() && coord->nodes.front() >= 0) {
            const Value* point = field(nodes_[static_cast<std::size_t>(coord->nodes.front())], "point");
            if (point != nullptr) count = add_points(*point, to_world);
        }
        const Value* index = field(set, "coordIndex");
        if (index == nullptr) return;
        const bool counter_clockwise = flag(set, "ccw", true);
        corners_.clear();
        for (std::size_t i = 0; i < index->numbers.size(); ++i) {
            const double vertex = index->numbers[i];
            if (vertex == -1.0) {
                add_polygon(index->lines[i], counter_clockwise);
                continue;
            }
            if (!(vertex >= 0.0 && vertex < static_cast<double>(count)) || vertex != std::floor(vertex)) {
                fail(index->lines[i],
                     count == 0 ? std::string("-1 (the face set has no points)")
                                : fmt::format("a vertex number 0 to {} or -1", count - 1),
                     fmt::format("'{}'", vertex));
            }
            corners_.push_back(static_cast<Index>(first + static_cast<std::int64_t>(vertex)));
        }
        if (!index->lines.empty()) add_polygon(index->lines.back(), counter_clockwise);
    }

    std::int64_t add_points(const Value& point, const Eigen::Affine3d& to_world) {
        if (!point.nodes.empty()) fail(point.line, "numbers in 'point'", "a node");
        if (point.numbers.size() % 3 != 0) {
            fail(point.line, "three coordinates for every point", fmt::format("{} numbers", point.numbers.size()));
        }
        const auto count = static_cast<std::int64_t>(point.numbers.size() / 3);
        if (builder_.vertex_count() + count > most_vertices) {
            fail(point.line, fmt::format("at most {} vertices after USE", most_vertices), "more");
        }
        for (std::size_t i = 0; i < point.numbers.size(); i += 3) {
            const Vector3 local(finite(point, i, "point"), finite(point, i + 1, "point"),
                                finite(point, i + 2, "point"));
            const Vector3 p = to_world * local;
            if (!p.allFinite()) fail(point.lines[i], "a point that stays finite under the Transforms", "overflow");
            builder_.add_vertex(p[0], p[1], p[2]);
        }
        return count;
    }

    /// Adds `corners_` as one polygon. A face set with ccw FALSE lists them clockwise, so each triangle is turned.
    void add_polygon(std::int64_t line, bool counter_clockwise) {
        if (corners_.empty()) return;
        if (corners_.size() < 3) fail(line, "a face of at least 3 corners", std::to_string(corners_.size()));
        if (counter_clockwise) {
            builder_.add_polygon(corners_);
        } else {
            for (std::size_t i = 2; i < corners_.size(); ++i) {
                builder_.add_triangle(corners_[0], corners_[i], corners_[i - 1]);
            }
        }
        corners_.clear();
    }

    const Source& source_;
    Lexer lexer_;
    MeshBuilder builder_;
    std::vector<Node> nodes_;
    std::map<std::string_view, int> names_;
    std::vector<Index> corners_;
    std::vector<std::string> ignored_;
    std::int64_t visits_ = 0;
};

}  // namespace

Mesh read_vrml(const Source& source) { return VrmlReader(source).read(); }

}  // namespace trocar::mesh_text
