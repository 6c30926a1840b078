# Prints the paper's table of processing time from frames.csv: mean and standard deviation, milliseconds a frame.
# usage: awk -F, -f stage_table.awk frames.csv
# The paper's rows are sums of ours; what it does not count (decoding, messages, files) stands in rows of its own.
function group(step) {
    if (step ~ /^(subsampling|odometry)$/) return "odometry"
    if (step ~ /^(geometry)$/) return "projection"
    if (step ~ /^(ground|segmentation)$/) return "segmentation"
    if (step ~ /^(detection|tracking|removal)$/) return "tracking"
    return step
}
function add(name, value) {
    if (!(name in sum)) order[++names] = name
    sum[name] += value; squares[name] += value * value
}
function row(name, label,    mean, variance) {
    mean = sum[name] / frames; variance = squares[name] / frames - mean * mean
    printf "| %s | %.2f ± %.2f |\n", label, mean, sqrt(variance > 0 ? variance : 0)
}
NR == 1 {
    for (i = 1; i <= NF; i++) if ($i ~ /_ms$/ && $i != "latency_ms") { step[i] = $i; sub(/_ms$/, "", step[i]) }
    next
}
{
    split("", frame); total = 0; frames++
    for (i = 1; i <= NF; i++) if (i in step) { frame[group(step[i])] += $i; add("step " step[i], $i); total += $i }
    for (name in frame) add(name, frame[name])
    add("total", total)
}
END {
    print "| | ms a frame |"; print "|---|---|"
    count = split("odometry projection segmentation tracking", paper, " ")
    for (i = 1; i <= count; i++) row(paper[i], paper[i])
    for (i = 1; i <= names; i++) {
        name = order[i]
        if (name !~ /^step / && name != "total" && name !~ /^(odometry|projection|segmentation|tracking)$/) others[++rest] = name
    }
    n = asort_names(others, rest); for (i = 1; i <= n; i++) row(others[i], others[i])
    row("total", "**total**")
    print ""; print "| step | ms a frame |"; print "|---|---|"
    for (i = 1; i <= names; i++) if (order[i] ~ /^step /) row(order[i], substr(order[i], 6))
}
# Insertion sort: mawk, Debian's awk, has no asort.
function asort_names(list, count,    i, j, name) {
    for (i = 2; i <= count; i++) {
        name = list[i]
        for (j = i - 1; j > 0 && list[j] > name; j--) list[j + 1] = list[j]
        list[j + 1] = name
    }
    return count
}
