// What became of the packets and frames, each fault under its own name.
#pragma once

#include "driver/counter.hpp"

namespace dlod::driver {

/// Written by the thread that pushes packets, read by any. Every datagram that is pushed counts in `packets` and in
/// exactly one of those marked *; a lidar packet that waits for its confirmation counts in none for so long.
struct FrameBuilderCounters {
    Counter packets;
    Counter lidar_packets;         ///< * decoded into a frame
    Counter imu_packets;           ///< * decoded
    Counter duplicate_packets;     ///< * all columns had arrived before
    Counter late_packets;          ///< * of a frame that has been closed
    Counter wrong_size_packets;    ///< * neither of the lidar profile's size nor of an IMU packet's
    Counter wrong_type_packets;    ///< * right size, but the header says that it is no lidar packet
    Counter foreign_packets;       ///< * of another sensor (serial number, or sender where packets carry none)
    Counter implausible_packets;   ///< * frame or init id fits neither what came before nor what came after
    Counter damaged_packets;       ///< * most measurement ids contradict each other
    Counter dropped_packets;       ///< * no free frame was there to decode into
    Counter imu_unknown_packets;   ///< * IMU packets of a format that is not decoded
    Counter imu_invalid_packets;   ///< * IMU values that are no measurement
    Counter imu_rejected_samples;  ///< of imu_packets: twice, at an absurd time, or too many for one frame

    Counter reordered_packets;    ///< of lidar_packets: came after a later one
    Counter lost_packets;         ///< missing in frames (not before a stream's first or after its last packet)
    Counter invalid_columns;      ///< the sensor itself marked them invalid
    Counter misnumbered_columns;  ///< measurement id contradicts the rest of the packet
    Counter mistimed_columns;     ///< time contradicts the rest of the frame
    Counter clock_jumps;          ///< from frame to frame, against the sensor's rate
    Counter restarts;             ///< the sensor's init id changed
    Counter frame_id_jumps;       ///< frame ids went on elsewhere

    Counter frames;             ///< emitted
    Counter incomplete_frames;  ///< of frames: with gaps
    Counter unusable_frames;    ///< of frames: too few valid columns for odometry (not where a stream was joined)
    Counter lost_frames;        ///< nothing of them arrived
    Counter dropped_frames;     ///< arrived when no free frame was there

    void visit(const CounterVisitor& visit) const {
        visit("packets", packets.value());
        visit("lidar_packets", lidar_packets.value());
        visit("imu_packets", imu_packets.value());
        visit("duplicate_packets", duplicate_packets.value());
        visit("late_packets", late_packets.value());
        visit("wrong_size_packets", wrong_size_packets.value());
        visit("wrong_type_packets", wrong_type_packets.value());
        visit("foreign_packets", foreign_packets.value());
        visit("implausible_packets", implausible_packets.value());
        visit("damaged_packets", damaged_packets.value());
        visit("dropped_packets", dropped_packets.value());
        visit("imu_unknown_packets", imu_unknown_packets.value());
        visit("imu_invalid_packets", imu_invalid_packets.value());
        visit("imu_rejected_samples", imu_rejected_samples.value());
        visit("reordered_packets", reordered_packets.value());
        visit("lost_packets", lost_packets.value());
        visit("invalid_columns", invalid_columns.value());
        visit("misnumbered_columns", misnumbered_columns.value());
        visit("mistimed_columns", mistimed_columns.value());
        visit("clock_jumps", clock_jumps.value());
        visit("restarts", restarts.value());
        visit("frame_id_jumps", frame_id_jumps.value());
        visit("frames", frames.value());
        visit("incomplete_frames", incomplete_frames.value());
        visit("unusable_frames", unusable_frames.value());
        visit("lost_frames", lost_frames.value());
        visit("dropped_frames", dropped_frames.value());
    }
};

}  // namespace dlod::driver
