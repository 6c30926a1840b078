#include "tests/support/child_process.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "tests/support/namespaces.hpp"

namespace dlod::test {

ChildProcess::ChildProcess(std::vector<std::string> command) : ChildProcess(std::move(command), Options{}) {}

ChildProcess::ChildProcess(std::vector<std::string> command, const Options& options) {
    std::string name = (std::filesystem::temp_directory_path() / "dlod-child-XXXXXX").string();
    const int output = ::mkstemp(name.data());
    if (output < 0) throw std::runtime_error("cannot create " + name);
    output_file_ = name;
    std::vector<char*> arguments;
    for (auto& argument : command) arguments.push_back(argument.data());
    arguments.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ == 0) {
        ::dup2(output, STDOUT_FILENO);
        ::dup2(output, STDERR_FILENO);
        for (const auto& variable : options.environment) ::putenv(const_cast<char*>(variable.c_str()));
        if (options.largest_file) {
            const rlimit limit{*options.largest_file, *options.largest_file};
            ::setrlimit(RLIMIT_FSIZE, &limit);
            ::signal(SIGXFSZ, SIG_IGN);  // the write fails instead
        }
        ::execvp(arguments[0], arguments.data());
        ::_exit(127);
    }
    ::close(output);
    if (pid_ < 0) throw std::runtime_error("cannot fork");
}

ChildProcess::~ChildProcess() {
    if (!exit_code_ && pid_ > 0) {
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
    }
    std::error_code ignored;
    std::filesystem::remove(output_file_, ignored);
}

void ChildProcess::signal(int number) const {
    if (!exit_code_) ::kill(pid_, number);
}

std::optional<int> ChildProcess::wait(std::chrono::milliseconds timeout) {
    const auto deadline = std::chrono::steady_clock::now() + timeout;
    while (!exit_code_) {
        int status = 0;
        if (::waitpid(pid_, &status, WNOHANG) == pid_) {
            exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
        } else if (std::chrono::steady_clock::now() > deadline) {
            return std::nullopt;
        } else {
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
    }
    return exit_code_;
}

std::string ChildProcess::output() const {
    std::ifstream stream(output_file_);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
}

bool enter_network_namespace() {
    if (!enter_namespaces(CLONE_NEWNET)) return false;
    return std::system("ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo") == 0;
}

}  // namespace dlod::test
