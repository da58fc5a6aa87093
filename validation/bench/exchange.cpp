// What a message costs between two ranks, and a sum over all: two of the constants of the model of
// large machines in docs/theory/large.md.
//
//     mpirun -n 2 exchange_bench

#include <algorithm>
#include <cstdio>
#include <mpi.h>
#include <vector>

namespace {

/// Seconds of one `work`, the best of some rounds of `times`.
template <class Work> double seconds(int times, Work work)
{
    double best = 1e9;
    for (int round = 0; round < 5; ++round) {
        MPI_Barrier(MPI_COMM_WORLD);
        const double begun = MPI_Wtime();
        for (int k = 0; k < times; ++k)
            work();
        best = std::min(best, (MPI_Wtime() - begun) / times);
    }
    return best;
}

} // namespace

int main(int argc, char** argv)
{
    MPI_Init(&argc, &argv);
    int rank = 0, ranks = 1;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (rank == 0) std::puts("what,bytes,seconds");
    for (const int count : {1, 128, 1024, 8192, 65536, 1 << 20}) {
        if (ranks < 2) break;
        std::vector<double> out(std::size_t(count), 1), in(std::size_t(count), 0);
        const double there = seconds(count > 10000 ? 20 : 500, [&] {
            if (rank > 1) return;
            MPI_Sendrecv(out.data(), count, MPI_DOUBLE, 1 - rank, 0, in.data(), count, MPI_DOUBLE,
                         1 - rank, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        });
        if (rank == 0) std::printf("exchange,%zu,%.3g\n", sizeof(double) * out.size(), there);
    }
    double own = 1, sum = 0;
    const double reduced =
        seconds(500, [&] { MPI_Allreduce(&own, &sum, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD); });
    if (rank == 0) std::printf("sum over %d ranks,%zu,%.3g\n", ranks, sizeof sum, reduced);
    MPI_Finalize();
}
