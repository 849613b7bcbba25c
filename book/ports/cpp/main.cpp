// icp2d: scan matching on the command line; the commands are in README.md.

#include <exception>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "commands.hpp"
#include "errors.hpp"
#include "json.hpp"
#include "text.hpp"

namespace {

using Words = std::vector<std::string>;

Words split(const std::string& line) {
    std::istringstream words(line);
    return {std::istream_iterator<std::string>(words), {}};
}

/// Answers each line of a file; a command that fails leaves its error as the answer.
void batch(const std::filesystem::path& file, std::ostream& out) {
    for (const std::string& line : icp2d::read_lines(file)) {
        try {
            out << icp2d::answer(split(line), file.parent_path()) << '\n';
        } catch (const std::exception& error) {
            out << icp2d::JsonObject().add("error", error.what()).str() << '\n';
        }
    }
}

void run(const Words& words, std::ostream& out) {
    if (words.size() == 2 && words.front() == "batch") {
        batch(words.back(), out);
    } else {
        out << icp2d::answer(words, {}) << '\n';
    }
    if (!out.flush()) throw std::runtime_error("cannot write to standard output");
}

}  // namespace

int main(int argc, char* argv[]) {
    try {
        run({argv + 1, argv + argc}, std::cout);
        return 0;
    } catch (const icp2d::UsageError& error) {
        std::cerr << "icp2d: " << error.what() << '\n';
        return 2;
    } catch (const std::exception& error) {
        std::cerr << "icp2d: " << error.what() << '\n';
        return 1;
    }
}
