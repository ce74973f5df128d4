// Who may work now and who waits, in the order of arrival. A machine renders no faster for being
// asked by many at once, so requests queue here, and a full queue says so at once instead of making
// everybody late. Of a session, one client's stream of frames, only the newest request counts.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <list>
#include <mutex>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>

namespace relit::server {

/// A bounded queue before a bounded number of slots. Safe from any thread.
///
/// Strictly first come, first served: a slot that becomes free goes to the longest waiting, and a
/// newcomer never passes a waiter. (A mutex and a condition variable alone let newcomers pass:
/// measured, a request among eight clients then waits up to 18 times the median.)
///
/// A request of a session supersedes the older ones of that session, in the order in which they
/// ask here: those that work are told to stop, one that waits loses its place. The newcomer goes
/// to the end of the line, unless one of its own waited: then it takes over that one's place. At
/// the end, a user who drags faster than the line moves would start over with every frame and see
/// none until he lets go; in the old place he waits as long as anybody else, and nobody waits
/// longer for it. Who supersedes is let in though the line is full: somebody else leaves for it.
/// A session has at most one place in the line, and no session is remembered that has no request
/// here.
///
/// A line is for bursts. Once it has been full, more is asked for than can be done, and a long line
/// would make everybody late and nobody sooner: from then on newcomers are refused while as many wait
/// as work, so that who is let in waits for about one other's work. That ends when the slots have
/// been free for a fifth of a second's time. Nor is anybody let in who would not have his turn before
/// his deadline, by how long the work took lately.
class RenderSlots {
    struct Place;

public:
    using Clock = std::chrono::steady_clock;
    using Now = std::function<Clock::time_point()>;

    struct Settings {
        int max_running = 1;  ///< > 0
        int max_waiting = 64;
        std::string_view max_waiting_name =
            "max-queue";  ///< the setting, for the refusal; a constant
    };

    /// @param now  the time; tests pass their own and call recheck() after moving it
    explicit RenderSlots(Settings settings, Now now = Clock::now);
    RenderSlots(const RenderSlots&) = delete;
    RenderSlots& operator=(const RenderSlots&) = delete;
    ~RenderSlots() = default;

    /// The right to work, given back when it is destroyed. Must not outlive its RenderSlots.
    class [[nodiscard]] Slot {
    public:
        Slot(Slot&& other) noexcept
            : slots_(std::exchange(other.slots_, nullptr)),
              place_(other.place_),
              waited_(other.waited_) {}
        Slot& operator=(Slot&&) = delete;
        ~Slot() {
            if (slots_) slots_->release(place_);
        }

        /// How long it was waited for.
        [[nodiscard]] Clock::duration waited() const { return waited_; }

        /// Set when a newer request of the session has come: the work is to stop.
        [[nodiscard]] std::stop_token stop_token() const { return place_->superseded.get_token(); }

    private:
        friend class RenderSlots;
        Slot(RenderSlots* slots, std::list<Place>::iterator place, Clock::duration waited)
            : slots_(slots), place_(place), waited_(waited) {}
        RenderSlots* slots_;
        std::list<Place>::iterator place_;
        Clock::duration waited_{};
    };

    /// A slot, at once or when it is this caller's turn.
    ///
    /// @param session  whose older requests this one supersedes; empty: nobody's
    /// @throws Error queue_full (as many wait as may, or too many for the deadline, and it supersedes
    ///         nobody), timed_out
    ///         (`deadline` has passed), cancelled (`stop` is set), superseded (by a newer request of
    ///         the session); after each of them the caller's place is gone
    Slot wait_for_slot(Clock::time_point deadline, const std::stop_token& stop,
                       std::string_view session = {});

    /// Supersedes the requests of a session for one that needs no slot.
    void supersede(std::string_view session);

    [[nodiscard]] int running() const;
    [[nodiscard]] int waiting() const;

    /// Has the line been full, and is it kept short since?
    [[nodiscard]] bool overloaded() const;

    /// How long nobody has worked or waited here: 0 while somebody does.
    [[nodiscard]] Clock::duration idle_for() const;

    /// Has every waiter look at the time again; for clocks that do not run by themselves.
    void recheck();

private:
    struct Place {
        explicit Place(std::string_view its_session) : session(its_session) {}
        std::string session;
        std::stop_source superseded{};
        std::condition_variable_any
            changed{};  // one each, so that a free slot wakes exactly its next owner
        enum { waiting, running, displaced } state = waiting;
        Clock::time_point began{};  // to work
        bool recheck = false;
    };
    using Places = std::list<Place>;

    [[nodiscard]] Places::iterator waiting_of(std::string_view session);
    [[nodiscard]] std::list<std::stop_source> working_for(std::string_view session) const;
    void check_room(Clock::time_point arrival, Clock::time_point deadline);
    void note_spare(Clock::time_point now);
    void look_for_calm(Clock::time_point now);
    void displace(Places::iterator older);
    void wait_in_line(std::unique_lock<std::mutex>& lock, Places::iterator place,
                      Clock::time_point deadline, const std::stop_token& stop);
    void run_next() noexcept;
    void release(Places::iterator place) noexcept;

    const Settings settings_;
    const Now now_;
    mutable std::mutex mutex_;
    // A place moves from list to list and stays where it is in memory.
    Places line_;                  // longest waiting first
    Places running_;               // their owners hold slots
    Clock::time_point last_used_;  // when the last slot was given back
    bool used_ = false;
    Places displaced_;  // lost their place in the line and do not know it yet

    std::chrono::duration<double> usual_work_{0};  // how long slots are held, lately
    bool overloaded_ = false;
    Clock::time_point watched_since_;  // for calm
    Clock::duration spare_{};          // not all slots were in use, since then
    Clock::time_point noted_;          // up to here `spare_` is counted
};

}  // namespace relit::server
