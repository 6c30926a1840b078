# Plots of a run. usage: gnuplot -e "run='DIR'; out='DIR'; errors='FILE or empty'" plots.gp
set datafile separator ','
set terminal svg size 900,360 font 'sans,11' background rgb 'white'
set grid lc rgb '#dddddd'
set key outside right top
set style fill solid 0.85 noborder

set output out.'/milliseconds.svg'
set title 'Milliseconds a frame, by step'
set xlabel 'frame'
set ylabel 'ms'
set yrange [0:*]
# Columns 9 and up are the steps; drawn upon each other, the last one first.
colors = '#4e79a7 #a0cbe8 #f28e2b #ffbe7d #59a14f #b6992d #e15759 #ff9d9a #79706e #d37295 #9d7660 #bab0ac'
columns = int(system("head -1 '".run."/frames.csv' | tr ',' '\\n' | wc -l"))
name(i) = system(sprintf("head -1 '%s/frames.csv' | cut -d, -f%d | sed s/_ms//", run, i))
total(last) = sum [i=9:last] column(i)
plot for [i=columns:9:-1] run.'/frames.csv' skip 1 using 1:(total(i)) with filledcurves x1 lc rgb word(colors, (i - 9) % 12 + 1) title name(i)

if (strlen(errors) > 0) {
    set output out.'/trajectory_error.svg'
    set title 'Error of the pose against truth'
    set xlabel 'time, s'
    set ylabel 'position, mm'
    set y2label 'rotation, degrees'
    set ytics nomirror
    set y2tics
    set y2range [0:*]
    plot errors skip 1 using 1:($2*1000) with lines lw 2 title 'position', \
         errors skip 1 using 1:3 axes x1y2 with lines lw 2 title 'rotation'
}
