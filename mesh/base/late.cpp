#include "mesh/base/late.hpp"

#include <mutex>

namespace amontons {

struct Once::Flag {
    std::once_flag flag;
};

Once::Once() : flag_(std::make_unique<Flag>()) {}
Once::~Once() = default;

void Once::run(void (*work)(void*), void* of)
{
    std::call_once(flag_->flag, work, of);
}

} // namespace amontons
