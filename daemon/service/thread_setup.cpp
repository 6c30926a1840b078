#include "daemon/service/thread_setup.hpp"

#include <pthread.h>
#include <sched.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>

namespace dlod::daemon {

void set_up_thread(const char* name, const PipelineConfig& config) {
    ::pthread_setname_np(::pthread_self(), name);
    if (!config.pin_to_cpus.empty()) {
        cpu_set_t cpus;
        CPU_ZERO(&cpus);
        for (const double cpu : config.pin_to_cpus) CPU_SET(static_cast<std::size_t>(cpu), &cpus);
        if (const int error = ::pthread_setaffinity_np(::pthread_self(), sizeof(cpus), &cpus); error != 0) {
            spdlog::warn("pipeline.pin_to_cpus: refused ({}); are there such CPUs?", std::strerror(error));
        }
    }
    if (config.realtime_priority > 0) {
        const sched_param priority{.sched_priority = config.realtime_priority};
        if (const int error = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &priority); error != 0) {
            spdlog::warn("pipeline.realtime_priority: refused ({}); the service needs CAP_SYS_NICE or LimitRTPRIO={}",
                         std::strerror(error), config.realtime_priority);
        }
    }
}

void lock_memory(const PipelineConfig& config) {
    // What has been used stays; the heap's addresses in reserve and the stacks' depths need no memory for it.
    if (!config.lock_memory || ::mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0) return;
    spdlog::warn("pipeline.lock_memory: refused ({}); the service needs LimitMEMLOCK=infinity", std::strerror(errno));
}

}  // namespace dlod::daemon
